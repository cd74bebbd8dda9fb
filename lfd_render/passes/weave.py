"""Weaving: view images → the panel image, by the profile's phase tables."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import DisplayProfile, ViewGrid
from lfd_render.gpu import raw as gl
from lfd_render.gpu.device import Device
from lfd_render.gpu.framebuffer import LayerTarget
from lfd_render.gpu.memory import TableTexture, TextureArray
from lfd_render.gpu.programs import Uniform
from lfd_render.passes.screen import ScreenPass
from lfd_render.passes.view_target import Band


class Weave:
    """Band of view images → panel image [y, x, RGBA] in scene-linear half float, row 0 on top.

    Each subpixel takes the nearest view at the centre of its lens on its row: the lens's own column
    where views follow the lenses, linear between two columns where they stand upright.
    """

    def __init__(self, device: Device, profile: DisplayProfile, grid: ViewGrid, views: int) -> None:
        self._profile = profile
        self._grid = grid
        width, height = profile.resolution_px
        tables = profile.phase_tables()
        fixed = tables.fixed(views)
        columns_per_lens, lens_0 = lens_columns(profile, grid)
        lens_0 = lens_0 + fixed.lenses * columns_per_lens
        self._pass = ScreenPass(
            device,
            "weave/weave.frag",
            {
                "LINEAR_COLUMNS": int(grid.kind == "upright"),
                "PATTERN_MODE": tables.pattern_mode,
                "CELL_KINDS": len(tables.cell),
            },
        )
        self._tables = {
            "column_table": _table(device, _words(fixed.column)),
            "row_table": _table(
                device, _words(fixed.row), lens_0.astype(np.float32).view(np.uint32)
            ),
        }
        self._uniforms: dict[str, Uniform] = {
            "subpixel_phases": _words(fixed.subpixel).tobytes(),
            "columns_per_lens": columns_per_lens,
            "panel_px": (width, height),
        }
        self.panel = TextureArray(device, "panel image", (width, height, 1), gl.RGBA16F)
        self.framebuffer = LayerTarget(device, self.panel, depth=False)

    def __call__(self, band: Band) -> None:
        """Weave the panel rows that show this band."""
        width, height = self._profile.resolution_px
        starts = self._grid.first_panel_rows(height)
        self.framebuffer.use(0)
        self._pass(
            {"FrameBlock": band.frame()},
            self._uniforms,
            {**self._tables, "view_images": band.target.images},
            (int(starts[band.first]), int(starts[band.first + band.rows])),
            width,
        )

    def read_linear(self) -> NDArray[np.float16]:
        """The panel image as float16 [y, x, 3]."""
        self.framebuffer.use(0)
        return self.framebuffer.read_rgb(gl.HALF_FLOAT, np.float16).astype(np.float16, copy=False)

    def release(self) -> None:
        """Free everything."""
        for table in self._tables.values():
            table.release()
        self.framebuffer.release()
        self.panel.release()
        self._pass.release()


def lens_columns(profile: DisplayProfile, grid: ViewGrid) -> tuple[float, NDArray[np.float64]]:
    """Where lens k appears in a view: column position = k·columns_per_lens + row_columns[panel y].

    Returns columns_per_lens and row_columns, float64 [panel height]. Lens-aligned: lens k is
    column k − row_base. Upright: the lens centre at u = (k + ½ + center)/P − v·T.
    """
    height = profile.resolution_px[1]
    y = np.arange(height)
    if grid.kind == "lens":
        view_row = np.minimum((2 * y + 1) * grid.rows // (2 * height), grid.rows - 1)
        return 1.0, 0.5 - grid.row_base[view_row].astype(np.float64)
    v = (height - y - 0.5) / height
    count = profile.lens_count
    offsets = (0.5 + profile.center) / count - v * profile.drift
    return grid.columns / count, grid.columns * offsets


def _words(phases: NDArray[np.int64]) -> NDArray[np.uint32]:
    """Fixed phases → uint32 [..., 2]: whole views (two's complement), fraction."""
    words = np.stack([phases >> 32, phases & 0xFFFFFFFF], axis=-1)
    return (words & 0xFFFFFFFF).astype(np.uint32)


def _table(
    device: Device, phases: NDArray[np.uint32], third: NDArray[np.uint32] | None = None
) -> TableTexture:
    """Entries of a phase and, if given, one more word."""
    words = np.zeros((len(phases), 4), np.uint32)
    words[:, :2] = phases
    if third is not None:
        words[:, 2] = third
    return TableTexture(device, "weave", words)

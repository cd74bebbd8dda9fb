"""Weaving: view images → the panel image, by the profile's phase tables."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import DisplayProfile, Reconstruction, ViewGrid
from lfd_render.gpu import raw as gl
from lfd_render.gpu.device import Device
from lfd_render.gpu.framebuffer import LayerTarget
from lfd_render.gpu.memory import TableTexture, TextureArray
from lfd_render.gpu.programs import Kernel, Samplers, Uniform
from lfd_render.passes.screen import ScreenPass
from lfd_render.passes.view_target import Band, ViewImages

NO_ROW = 0xFFFFFFFF
_VIEWS_UNIT = 2  # of images, in weave/views.glsl
MOST_INDEXED_VIEWS = 1 << 10  # what places.frag has bits for
MOST_INDEXED_COLUMNS = 1 << 16
NEAREST = Reconstruction()


class Weave:
    """ViewImages → panel image [y, x, RGBA], row 0 on top, as a Reconstruction has it.

    In scene-linear half floats, or encoded, in bytes, from encoded view images. The reference is
    `reference.woven`.
    """

    def __init__(
        self,
        device: Device,
        profile: DisplayProfile,
        grid: ViewGrid,
        views: int,
        rule: Reconstruction = NEAREST,
        *,
        encoded: bool = False,
        pictures: bool = False,
    ) -> None:
        """pictures: view images are in sRGB, not in linear light or, if encoded, codes."""
        assert not (encoded and pictures)
        self._profile, self._grid = profile, grid
        self._loads = not pictures
        width, height = profile.resolution_px
        form = gl.RGBA8 if encoded else gl.RGBA16F
        self.panel = TextureArray(device, "panel image", (width, height, 1), form)
        self.framebuffer = LayerTarget(device, self.panel)
        phases = _Phases(device, profile, grid, views)
        phases.constants |= {"ENCODED": int(encoded), "PICTURES": int(pictures)}
        self._step: _Nearest | _Mixed
        if is_exact(rule, grid) and _has_bits(grid, views):
            self._step = _Nearest(device, phases, self.panel)
        else:
            kind = _Mixed if rule.aa == "none" else _Filtered
            self._step = kind(device, profile, grid, rule, phases)

    def __call__(self, shown: ViewImages | Band) -> None:
        """Weave the panel rows that show these view rows."""
        images = shown.view_images() if isinstance(shown, Band) else shown
        starts = self._grid.first_panel_rows(self._profile.resolution_px[1])
        first, end = images.shown
        if self._loads:
            images.images.bind_image(_VIEWS_UNIT, writeonly=False)
        self.framebuffer.use(0)
        self._step(images, (int(starts[first]), int(starts[end])))

    def read_linear(self) -> NDArray[np.float16]:
        """The panel image as float16 [y, x, 3]."""
        self.framebuffer.use(0)
        return self.framebuffer.read_rgb(gl.HALF_FLOAT, np.float16).astype(np.float16, copy=False)

    def read_encoded(self) -> NDArray[np.uint8]:
        """The panel image as uint8 [y, x, 3]."""
        self.framebuffer.use(0)
        return self.framebuffer.read_rgb(gl.UNSIGNED_BYTE, np.uint8).astype(np.uint8, copy=False)

    def release(self) -> None:
        """Free everything."""
        self._step.release()
        self.framebuffer.release()
        self.panel.release()


def is_exact(rule: Reconstruction, grid: ViewGrid) -> bool:
    """Whether each subpixel shows one view pixel as it is."""
    at_lens = grid.kind == "lens" and grid.fineness == 1 and rule.lookup == "lens"
    return at_lens and rule.weave == "nearest" and rule.aa == "none"


def _has_bits(grid: ViewGrid, views: int) -> bool:
    return views <= MOST_INDEXED_VIEWS and grid.columns <= MOST_INDEXED_COLUMNS


class _Phases:
    """The tables that give subpixels their phases, and the constants that go with them."""

    def __init__(self, device: Device, profile: DisplayProfile, grid: ViewGrid, views: int) -> None:
        tables = profile.phase_tables()
        fixed = tables.fixed(views)
        height = profile.resolution_px[1]
        first_lens = (fixed.lenses * views) << 32
        row_words = _words(fixed.row + first_lens, views)
        row_words[:, 3] = _word(-grid.row_base[view_rows(grid, height)])
        self.textures = {
            "column_table": TableTexture(device, "weave", _words(fixed.column, views)),
            "row_table": TableTexture(device, "weave", row_words),
        }
        if tables.correction is not None:
            correction = _words(tables.fixed_correction(views), views)
            self.textures["correction_table"] = TableTexture(device, "weave", correction)
        kinds = len(tables.cell)
        cells = _words(fixed.subpixel.reshape(-1), views)[:, :3]
        self.uniforms: dict[str, Uniform] = {"subpixel_phases": cells.tobytes()}
        self.constants: dict[str, int | float] = {
            "PATTERN_MODE": tables.pattern_mode,
            "CELL_KINDS": kinds,
            "INVERTED": int(tables.inverted),
            "CORRECTED": int(tables.correction is not None),
            "VIEWS": views,
            "COLUMNS": grid.columns,
            "PANEL_ROWS": height,
            "VIEW_ROWS": grid.rows,
        }

    def release(self) -> None:
        for table in self.textures.values():
            table.release()


class _Nearest:
    """The lens's own column of the nearest view, from a map made once."""

    def __init__(self, device: Device, phases: _Phases, panel: TextureArray) -> None:
        """The phases are released when the map is made."""
        pairs = (panel.width + 1) // 2
        self._places = TextureArray(device, "weave", (pairs, panel.height, 1), gl.RGBA32UI)
        target = LayerTarget(device, self._places)
        constants = {**phases.constants, "PANEL_COLUMNS": panel.width, "LANES": device.lanes}
        make_map = ScreenPass(device, "weave/places.frag", constants)
        target.use(0)
        make_map({}, phases.uniforms, phases.textures, (0, panel.height), pairs)
        for owner in (target, make_map, phases):
            owner.release()
        self._panel = panel
        self._kernel = Kernel(device, "weave/nearest.comp", constants)

    def __call__(self, images: ViewImages, rows: tuple[int, int]) -> None:
        first, end = rows
        self._panel.bind_image(0)
        self._places.bind_image(1, writeonly=False)
        uniforms: dict[str, Uniform] = {"first_row": images.first, "first_panel_row": first}
        self._kernel.set({}, uniforms, {"view_images": images.images})
        self._kernel.run((end - first, 1, 1))

    def release(self) -> None:
        self._kernel.release()
        self._places.release()


class _Mixed:
    """Nearest or linear in views and columns, unfiltered."""

    _shader = "weave/mixed.frag"

    def __init__(
        self,
        device: Device,
        profile: DisplayProfile,
        grid: ViewGrid,
        rule: Reconstruction,
        phases: _Phases,
    ) -> None:
        """The phases are released with this."""
        assert rule.aa != "none" or grid.fineness == 1
        self._phases, self._width = phases, profile.resolution_px[0]
        samples = sample_rows(profile, grid, rule)
        self._rows = TableTexture(device, "weave", samples)
        at_lens = rule.lookup == "lens"
        self._pass = ScreenPass(
            device,
            self._shader,
            {
                **self._phases.constants,
                "COLUMNS_PER_LENS": grid.fineness if grid.kind == "lens" else 0,
                "AT_LENS": int(at_lens),
                "LINEAR_VIEWS": int(rule.weave == "linear"),
                "LINEAR_COLUMNS": int(not (at_lens and grid.kind == "lens")),
                "SAMPLES": len(samples),
                "NO_ROW": NO_ROW,
            },
        )
        self._uniforms: dict[str, Uniform] = {
            **self._phases.uniforms,
            "columns_per_lens": grid.columns_at(profile)[0],
        }

    def __call__(self, images: ViewImages, rows: tuple[int, int]) -> None:
        samplers: Samplers = {
            **self._phases.textures,
            "row_samples": self._rows,
            "view_images": images.images,
        }
        uniforms = {**self._uniforms, "first_row": images.first}
        self._pass({}, uniforms, samplers, rows, self._width)

    def release(self) -> None:
        self._pass.release()
        self._rows.release()
        self._phases.release()


class _Filtered(_Mixed):
    """Gaussian over view pixels, views or both."""

    _shader = "weave/filtered.frag"

    def __init__(
        self,
        device: Device,
        profile: DisplayProfile,
        grid: ViewGrid,
        rule: Reconstruction,
        phases: _Phases,
    ) -> None:
        super().__init__(device, profile, grid, rule, phases)
        apart = rule.offsets()[:, 2]
        whole = np.floor(apart)
        fraction = np.rint((apart - whole) * 2.0**32).astype(np.int64)
        words = np.stack([_word(whole), _word(fraction)], axis=-1)
        self._uniforms["view_offsets"] = words.tobytes()


def sample_rows(
    profile: DisplayProfile, grid: ViewGrid, rule: Reconstruction
) -> NDArray[np.uint32]:
    """For each sample of a rule and panel row, uint32 [sample, y, 4]: view row, or NO_ROW outside;
    base and offset (float bits) of weave/columns.glsl, with the sample's columns. Unfiltered, one
    sample: the offset counts in column centres, or is that of the lens's own column."""
    height = profile.resolution_px[1]
    y = np.arange(height)
    v = (height - y - 0.5) / height
    scale, row_column = grid.columns_at(profile)
    at_row = (y + 0.5) / height * grid.rows
    filtered = rule.aa != "none"
    exact = grid.kind == "lens" and rule.lookup == "lens" and not filtered
    offsets = rule.offsets()
    words = np.zeros((len(offsets), height, 4), np.uint32)
    for sample, (columns, rows, _) in enumerate(offsets):
        row = np.floor(at_row + rows).astype(np.int64) if filtered else view_rows(grid, height)
        inside = (row >= 0) & (row < grid.rows)
        row = np.clip(row, 0, grid.rows - 1)
        along = profile.center - v * profile.drift * profile.lens_count
        offset = scale * along + row_column[row] + (columns if filtered else -0.5)
        base = -grid.row_base[row].astype(np.int64) * grid.fineness
        if grid.kind == "lens":
            offset -= base  # which leaves little, so that single precision places it well
        if exact:
            offset[:] = 0.0
        words[sample, :, 0] = np.where(inside, row, NO_ROW)
        words[sample, :, 1] = _word(base)
        words[sample, :, 2] = offset.astype(np.float32).view(np.uint32)
    return words


def view_rows(grid: ViewGrid, height: int) -> NDArray[np.int64]:
    """View row that each panel row lies in, [height]."""
    y = np.arange(height, dtype=np.int64)
    return (2 * y + 1) * grid.rows // (2 * height)


def _words(phases: NDArray[np.int64], views: int) -> NDArray[np.uint32]:
    """Fixed phases → uint32 [..., 4]: whole lenses (two's complement), views, fraction, 0."""
    whole = phases >> 32
    lens = whole // views
    words = np.zeros((*phases.shape, 4), np.uint32)
    words[..., 0] = _word(lens)
    words[..., 1] = whole - lens * views
    words[..., 2] = _word(phases)
    return words


def _word(values: NDArray[np.integer] | NDArray[np.float64]) -> NDArray[np.uint32]:
    """The low 32 bits of whole numbers."""
    return (values.astype(np.int64) & 0xFFFFFFFF).astype(np.uint32)

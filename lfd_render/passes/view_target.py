"""Where views are rendered: rig and grid on the device, in bands of rows that fit its buffers.

Rows are independent of each other in every pass, so a view set of any size is rendered in bands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lfd_render.display import Rig, ViewGrid
from lfd_render.errors import ResourceError
from lfd_render.gpu import raw as gl
from lfd_render.gpu.device import Device
from lfd_render.gpu.layout import dtype
from lfd_render.gpu.memory import Buffer, TextureArray
from lfd_render.gpu.programs import Uniform
from lfd_render.gpu.scene_buffers import Batch
from lfd_render.passes.encode import EncodeColor
from lfd_render.passes.placement import Placement

BAND_BYTES = 64 << 20  # of one 32-bit word a view pixel; two fit a buffer of llvmpipe, 128 MiB
MOST_BAND_ROWS = 1000  # with at most 4 Mi triangles a batch, items stay below 2³²


@dataclass(frozen=True, eq=False)
class ViewImages:
    """Images of all views, [view, row, column], in linear light or encoded, whose row 0 is view row
    `first`; the panel rows that show the view rows `shown`, [first, end), can be woven from
    them."""

    images: TextureArray
    first: int
    shown: tuple[int, int]


@dataclass(frozen=True, eq=False)
class Band:
    """Rows [first, first + rows) of the views of a target; the panel takes those in `shown`,
    [first, end), and a filter what lies around them."""

    target: ViewTarget
    first: int
    rows: int
    shown: tuple[int, int]

    def view_images(self) -> ViewImages:
        """What of the views this band holds."""
        return ViewImages(self.target.images, self.first, self.shown)

    def frame(self, batch: Batch | None = None) -> Buffer:
        """The Frame block of this band and a batch; of any, for passes that read no triangles."""
        return self.target.frame_blocks[self, batch.triangle_base if batch else 0]


class ViewTarget:
    """Rig, grid and bands, with the view images [view, row of the band, column], in linear light,
    or encoded if nothing is asked of them but codes."""

    def __init__(
        self,
        device: Device,
        rig: Rig,
        grid: ViewGrid,
        batches: Sequence[Batch],
        seed: int = 0,
        *,
        row_step: int = 1,
        halo: int = 0,
        encoded: bool = False,
    ) -> None:
        """row_step: bands hold a multiple of so many rows. halo: rows around those shown, a
        multiple of it too."""
        assert grid.rows % row_step == halo % row_step == 0
        self.rig = rig
        self.encoded = encoded
        self.grid = grid
        row_bytes = 4 * rig.views * grid.columns
        most = min(MOST_BAND_ROWS, BAND_BYTES // row_bytes)
        self.band_rows = min(grid.rows, most // row_step * row_step)
        step = self.band_rows if self.band_rows == grid.rows else self.band_rows - 2 * halo
        if step < row_step or max(grid.rows, grid.columns) >= 1 << 16:
            raise ResourceError(
                f"views: {rig.views} views of {grid.columns}×{grid.rows} do not fit the device; "
                "use fewer or smaller views"
            )
        self.bands = [
            self._band(first, min(first + step, grid.rows), halo)
            for first in range(0, grid.rows, step)
        ]
        # One row suffices to have a device compile all that a frame will run.
        middle = grid.rows // 2 // row_step * row_step
        self.warm_up_band = self._band(middle, middle + row_step, 0)
        self.eyes = Buffer.of(device, "rig", (rig.eye_x_mm / grid.column_mm).astype(np.float32))
        self.row_offsets = Buffer.of(device, "rig", grid.row_offset.astype(np.float32))
        self.images = TextureArray(
            device,
            "view images",
            (grid.columns, self.band_rows, rig.views),
            gl.RGBA8 if encoded else gl.RGBA16F,
        )
        self.images.parameters(gl.NEAREST, gl.NEAREST, ("clamp", "clamp"))
        self._background = EncodeColor(device) if encoded else None
        self.frame_blocks = {
            (band, batch.triangle_base): Buffer.of(
                device, "frame", _frame_record(band, batch, seed)
            )
            for band in (*self.bands, self.warm_up_band)
            for batch in batches
        }

    def _band(self, first: int, end: int, halo: int) -> Band:
        start, stop = max(first - halo, 0), min(end + halo, self.grid.rows)
        return Band(self, start, stop - start, (first, end))

    def shaded(self, placement: Placement) -> dict[str, Uniform]:
        """Clear the images to a frame's background and make them what shaders store to; what those
        shaders need to know (shade/images.glsl, where ENCODED is `encoded`)."""
        color, exposure = placement.background, placement.exposure
        known: dict[str, Uniform] = {}
        if self._background:
            color, known = self._background(color, exposure), {"exposure": exposure}
        self.images.clear((*color, 0.0))
        self.images.bind_image(0)
        return known

    @property
    def band_pixels(self) -> int:
        """View pixels of the largest band."""
        return self.band_rows * self.rig.views * self.grid.columns

    def release(self) -> None:
        """Free everything."""
        for buffer in (self.eyes, self.row_offsets, *self.frame_blocks.values()):
            buffer.release()
        self.images.release()
        if self._background:
            self._background.release()


def _frame_record(band: Band, batch: Batch, seed: int) -> np.ndarray[tuple[int], np.dtype[np.void]]:
    rig, grid = band.target.rig, band.target.grid
    record = np.zeros(1, dtype("Frame"))
    width, height = rig.panel_mm
    record["distance_mm"] = rig.distance_mm
    record["near_mm"] = rig.near_mm
    record["panel_width_mm"], record["panel_height_mm"] = width, height
    record["column_mm"] = grid.column_mm
    record["row_mm"] = height / grid.rows
    record["eye_first"] = rig.eye_x_mm[0] / grid.column_mm
    record["eye_last"] = rig.eye_x_mm[-1] / grid.column_mm
    record["columns"], record["rows"], record["views"] = grid.columns, grid.rows, rig.views
    record["band_first"], record["band_rows"] = band.first, band.rows
    record["triangles"], record["triangle_base"] = batch.triangles, batch.triangle_base
    record["seed"] = seed & 0xFFFFFFFF
    return record

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
from lfd_render.gpu.scene_buffers import Batch

BAND_BYTES = 96 << 20  # of one 32-bit word a view pixel; llvmpipe allows 128 MiB a buffer
MOST_BAND_ROWS = 1000  # with at most 4 Mi triangles a batch, items stay below 2³²


@dataclass(frozen=True, eq=False)
class Band:
    """Rows [first, first + rows) of the views of a target."""

    target: ViewTarget
    first: int
    rows: int

    def frame(self, batch: Batch | None = None) -> Buffer:
        """The Frame block of this band and a batch; of any, for passes that read no triangles."""
        return self.target.frame_blocks[self, batch.triangle_base if batch else 0]


class ViewTarget:
    """Rig, grid and bands, with the view images [view, row of the band, column] in linear light.

    Pictures that are only woven come without batches, and may have a format of their own.
    """

    def __init__(
        self,
        device: Device,
        rig: Rig,
        grid: ViewGrid,
        batches: Sequence[Batch] = (),
        seed: int = 0,
        *,
        image_format: int = gl.RGBA16F,
    ) -> None:
        self.rig = rig
        self.grid = grid
        row_bytes = 4 * rig.views * grid.columns
        self.band_rows = min(grid.rows, MOST_BAND_ROWS, BAND_BYTES // row_bytes)
        if self.band_rows < 1 or max(grid.rows, grid.columns) >= 1 << 16:
            raise ResourceError(
                f"views: {rig.views} views of {grid.columns}×{grid.rows} do not fit the device; "
                "use fewer or smaller views"
            )
        self.bands = [
            Band(self, first, min(self.band_rows, grid.rows - first))
            for first in range(0, grid.rows, self.band_rows)
        ]
        # One row suffices to have a device compile all that a frame will run.
        self.warm_up_band = Band(self, grid.rows // 2, 1)
        self.eyes = Buffer.of(device, "rig", (rig.eye_x_mm / grid.column_mm).astype(np.float32))
        self.row_offsets = Buffer.of(device, "rig", grid.row_offset.astype(np.float32))
        self.images = TextureArray(
            device, "view images", (grid.columns, self.band_rows, rig.views), image_format
        )
        self.images.parameters(gl.NEAREST, gl.NEAREST, ("clamp", "clamp"))
        triangles = [(batch.triangles, batch.triangle_base) for batch in batches] or [(0, 0)]
        self.frame_blocks = {
            (band, base): Buffer.of(device, "frame", _frame_record(band, count, base, seed))
            for band in (*self.bands, self.warm_up_band)
            for count, base in triangles
        }

    @property
    def band_pixels(self) -> int:
        """View pixels of the largest band."""
        return self.band_rows * self.rig.views * self.grid.columns

    def release(self) -> None:
        """Free everything."""
        for buffer in (self.eyes, self.row_offsets, *self.frame_blocks.values()):
            buffer.release()
        self.images.release()


def _frame_record(
    band: Band, triangles: int, triangle_base: int, seed: int
) -> np.ndarray[tuple[int], np.dtype[np.void]]:
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
    record["triangles"], record["triangle_base"] = triangles, triangle_base
    record["seed"] = seed & 0xFFFFFFFF
    return record

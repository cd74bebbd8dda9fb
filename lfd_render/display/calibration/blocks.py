"""A photograph's light in blocks of the panel: what the fit reads of each, in place of its pixels.

Every photograph pixel goes to the block that its centre falls into, by the inverse homography, and
is not resampled; an edge of the panel, where blur mixes it with what is around, is left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lfd_render.display.calibration.corners import LINEAR, Corners, Float64, Pixels
from lfd_render.errors import PictureError

MARGIN = 0.015  # of the panel, left out at each side
CLIPPED_CODE = 254
MOST_CLIPPED = 0.03  # share of the panel
DARKEST_CODE = 24  # brightest thousandth of the panel, at least


@dataclass(frozen=True, eq=False)
class Blocks:
    """Blocks of one camera position, row by row from the top.

    u, v: centroids of their pixels, float64 [block], v from the bottom. grid: (rows, columns).
    """

    grid: tuple[int, int]
    u: Float64
    v: Float64
    filled: NDArray[np.bool_]  # [block]
    size_px: tuple[int, int]
    _window: tuple[slice, slice]
    _block: NDArray[np.int32]  # [y, x] of the window; the number of blocks where outside
    _count: Float64

    @staticmethod
    def of(corners: Corners, size_px: tuple[int, int], grid: tuple[int, int]) -> Blocks:
        """Blocks of a panel with these corners in photographs of this size (width, height)."""
        rows, columns = grid
        low = np.floor(corners.xy_px.min(axis=0)).astype(int)
        high = np.ceil(corners.xy_px.max(axis=0)).astype(int)
        window = (
            slice(max(0, low[1]), min(size_px[1], high[1])),
            slice(max(0, low[0]), min(size_px[0], high[0])),
        )
        y = np.arange(window[0].start, window[0].stop)[:, None] + 0.5
        x = np.arange(window[1].start, window[1].stop)[None, :] + 0.5
        u, v_top = panel_from_photo(corners.photo_from_panel(), x, y)
        column = np.floor((u - MARGIN) / (1 - 2 * MARGIN) * columns)
        row = np.floor((v_top - MARGIN) / (1 - 2 * MARGIN) * rows)
        inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
        count = rows * columns
        block = np.where(inside, row * columns + column, count).astype(np.int32)
        flat = block.ravel()
        pixels = np.bincount(flat, minlength=count + 1)[:count].astype(np.float64)
        some = np.maximum(pixels, 1)
        return Blocks(
            grid,
            np.bincount(flat, u.ravel(), count + 1)[:count] / some,
            1 - np.bincount(flat, v_top.ravel(), count + 1)[:count] / some,
            pixels >= 0.3 * np.median(pixels) + 1,
            size_px,
            window,
            block,
            some,
        )

    def light(self, pixels: Pixels, name: str) -> Float64:
        """Mean light of each block, decoded as sRGB, three channels together, [block].

        Raises PictureError for a photograph of another size, or too bright or dark to measure.
        """
        if pixels.shape[1::-1] != self.size_px:
            width, height = self.size_px
            raise PictureError(
                f"{name}: has {pixels.shape[1]} x {pixels.shape[0]} pixels, the others of its set "
                f"{width} x {height}; take all of a set with one camera that does not move"
            )
        window = pixels[self._window]
        inside = self._block < len(self.u)
        brightest = window.max(axis=2)[inside]
        clipped = float((brightest >= CLIPPED_CODE).mean())
        if clipped > MOST_CLIPPED:
            raise PictureError(
                f"{name}: {100 * clipped:.0f} % of the panel is clipped; expose less, so that "
                "the white pattern stays below white, and lock the exposure"
            )
        if np.quantile(brightest, 0.999) < DARKEST_CODE:
            raise PictureError(
                f"{name}: the panel is darker than code {DARKEST_CODE} of 255; expose more, and "
                "lock the exposure"
            )
        light = LINEAR[window[..., 0]] + LINEAR[window[..., 1]] + LINEAR[window[..., 2]]
        sums = np.bincount(self._block.ravel(), light.ravel(), len(self.u) + 1)
        mean: Float64 = sums[:-1] / self._count
        return mean


def panel_from_photo(photo_from_panel: Float64, x: Float64, y: Float64) -> tuple[Float64, Float64]:
    """(u, v from the top) of photograph points."""
    m = np.linalg.inv(photo_from_panel)
    w = m[2, 0] * x + m[2, 1] * y + m[2, 2]
    return (m[0, 0] * x + m[0, 1] * y + m[0, 2]) / w, (m[1, 0] * x + m[1, 1] * y + m[1, 2]) / w

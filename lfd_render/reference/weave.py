"""Weaving: the panel image that shows each subpixel the view it belongs to.

The phase φ of a subpixel (`display.phase`) gives its lens ⌊φ⌋ and its view. It shows that view at
the centre of its lens on its own row: where views follow the lenses in the lens's own column, in
upright views at the window position u = (lens + ½ + center)/P − v·T, between two columns.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import DisplayProfile, ViewGrid

Float64 = NDArray[np.float64]
Int = NDArray[np.int64]

_BLOCK_ROWS = 64  # panel rows at once, which bounds memory


def woven(views: NDArray[np.floating], profile: DisplayProfile, grid: ViewGrid) -> Float64:
    """Panel image, linear float64 [y, x, rgb], of view images [view, row, column, rgb]."""
    width, height = profile.resolution_px
    tables = profile.phase_tables()
    panel = np.empty((height, width, 3))
    for start in range(0, height, _BLOCK_ROWS):
        rows = slice(start, min(start + _BLOCK_ROWS, height))
        phase = tables.phase(rows)
        panel[rows] = _looked_up(views, phase, np.arange(height)[rows], profile, grid)
    return panel


def _looked_up(
    views: NDArray[np.floating], phase: Float64, y: Int, profile: DisplayProfile, grid: ViewGrid
) -> Float64:
    """Subpixels [y, x, channel] of panel rows y, given their phases."""
    height = profile.resolution_px[1]
    lens = np.floor(phase)
    view = view_of(phase, len(views))
    row = ((y + 0.5) / height * grid.rows).astype(np.int64)[:, None, None]
    channel = np.arange(3)
    last = grid.columns - 1
    if grid.kind == "lens":
        column = np.clip(lens.astype(np.int64) - grid.row_base[row], 0, last)
        return np.asarray(views[view, row, column, channel], np.float64)
    v = ((height - y - 0.5) / height)[:, None, None]
    u = (lens + 0.5 + profile.center) / profile.lens_count - v * profile.drift
    at = u * grid.columns - 0.5  # counted in column centres
    left = np.floor(at).astype(np.int64)
    from_left = views[view, row, np.clip(left, 0, last), channel].astype(np.float64)
    from_right = views[view, row, np.clip(left + 1, 0, last), channel].astype(np.float64)
    mixed: Float64 = from_left + (at - left) * (from_right - from_left)
    return mixed


def view_of(phase: Float64, views: int) -> Int:
    """View of each phase: z = 1 − frac φ, ⌊z·N⌋, at most N − 1; view 0 is the leftmost."""
    z = 1.0 - (phase - np.floor(phase))
    return np.minimum(np.floor(z * views).astype(np.int64), views - 1)

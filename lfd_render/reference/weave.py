"""Weaving: the panel image that shows each subpixel the view it belongs to.

The phase φ of a subpixel (`display.phase`) gives its lens ⌊φ⌋ and its view coordinate a = N·z with
z = 1 − frac φ; view ⌊a⌋ is the nearest. Where that view is sampled and what is mixed or filtered is
`display.reconstruction`'s to say:

- unfiltered: on the view row that the panel row lies in, at the lens centre or the subpixel
  itself. Where views follow the lenses the lens's own column is taken; anywhere else two columns
  are mixed.
- filtered: the mean of nearest view pixels at fixed offsets in columns, rows and views. Offsets
  that lead out of the rows or beyond the first and last view do not count; columns end in their
  last.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import DisplayProfile, ViewGrid
from lfd_render.display.reconstruction import Reconstruction

Float64 = NDArray[np.float64]
Int = NDArray[np.int64]

_BLOCK_ROWS = 64  # panel rows at once, which bounds memory
NEAREST = Reconstruction()


def woven(
    views: NDArray[np.floating],
    profile: DisplayProfile,
    grid: ViewGrid,
    rule: Reconstruction = NEAREST,
) -> Float64:
    """Panel image, float64 [y, x, rgb], of view images [view, row, column, rgb].

    What the numbers are, linear light or codes, is all one to it.
    """
    width, height = profile.resolution_px
    tables = profile.phase_tables()
    panel = np.empty((height, width, 3))
    block = _filtered if rule.aa != "none" else _mixed
    for start in range(0, height, _BLOCK_ROWS):
        rows = slice(start, min(start + _BLOCK_ROWS, height))
        y = np.arange(height)[rows][:, None, None]
        panel[rows] = block(views, tables.phase(rows), y, profile=profile, grid=grid, rule=rule)
    return panel


def _mixed(
    views: NDArray[np.floating],
    phase: Float64,
    y: Int,
    *,
    profile: DisplayProfile,
    grid: ViewGrid,
    rule: Reconstruction,
) -> Float64:
    """Unfiltered subpixels [y, x, channel] of panel rows y, given their phases."""
    height = profile.resolution_px[1]
    row = ((y + 0.5) / height * grid.rows).astype(np.int64)
    column = (
        columns_of(phase, y, row, profile=profile, grid=grid, rule=rule) - 0.5
    )  # counted in column centres
    if grid.kind == "lens" and rule.lookup == "lens":
        left = np.floor(phase).astype(np.int64) - grid.row_base[row]
        across = np.zeros(1)
    else:
        left = np.floor(column).astype(np.int64)
        across = column - left
    if rule.weave == "nearest":
        low = high = view_of(phase, len(views), inverted=profile.viewing.inverted)
        between = np.zeros(1)
    else:
        at = len(views) * _z(phase, profile.viewing.inverted) - 0.5  # counted in view centres
        low = np.floor(at).astype(np.int64)
        between = at - low
        low, high = (np.clip(view, 0, len(views) - 1) for view in (low, low + 1))

    def taken(view: Int, column: Int) -> Float64:
        inside = np.clip(column, 0, grid.columns - 1)
        return np.asarray(views[view, row, inside, np.arange(3)], np.float64)

    from_low, from_high = (
        taken(view, left) + across * (taken(view, left + 1) - taken(view, left))
        for view in (low, high)
    )
    mixed: Float64 = from_low + between * (from_high - from_low)
    return mixed


def _filtered(
    views: NDArray[np.floating],
    phase: Float64,
    y: Int,
    *,
    profile: DisplayProfile,
    grid: ViewGrid,
    rule: Reconstruction,
) -> Float64:
    """Filtered subpixels [y, x, channel] of panel rows y, given their phases."""
    height = profile.resolution_px[1]
    count = len(views)
    at_row = (y + 0.5) / height * grid.rows
    at_view = count * _z(phase, profile.viewing.inverted)
    total, weight = np.zeros(phase.shape), np.zeros(phase.shape)
    for columns, rows, apart in rule.offsets():
        row = np.floor(at_row + rows).astype(np.int64)
        view = np.floor(at_view + apart).astype(np.int64)
        view[at_view + apart == count] = count - 1  # the last view's far end
        inside = (row >= 0) & (row < grid.rows) & (view >= 0) & (view < count)
        row, view = np.clip(row, 0, grid.rows - 1), np.clip(view, 0, count - 1)
        column = np.floor(
            columns_of(phase, y, row, profile=profile, grid=grid, rule=rule) + columns
        ).astype(np.int64)
        column = np.clip(column, 0, grid.columns - 1)
        total += inside * views[view, row, column, np.arange(3)].astype(np.float64)
        weight += inside
    return total / weight


def columns_of(
    phase: Float64,
    y: Int,
    row: Int,
    *,
    profile: DisplayProfile,
    grid: ViewGrid,
    rule: Reconstruction,
) -> Float64:
    """Column coordinate, centres at halves, in a view row, of the subpixels of panel rows y."""
    height = profile.resolution_px[1]
    v = (height - y - 0.5) / height
    along = np.floor(phase) + 0.5 if rule.lookup == "lens" else phase
    scale, offset = grid.columns_at(profile)
    u_lenses = along + profile.center - v * profile.drift * profile.lens_count
    return np.asarray(scale * u_lenses + offset[row])


def view_of(phase: Float64, views: int, *, inverted: bool = False) -> Int:
    """View of each phase: ⌊z·N⌋, at most N − 1; view 0 is the leftmost."""
    return np.minimum(np.floor(_z(phase, inverted) * views).astype(np.int64), views - 1)


def _z(phase: Float64, inverted: bool) -> Float64:
    """1 − frac φ, or frac φ where views run the other way under a lens."""
    within: Float64 = phase - np.floor(phase)
    return within if inverted else 1.0 - within

"""Unweaving: the views that a panel image shows, and weaving's exact inverse.

Every subpixel goes back to where weaving looked it up: its view, its row, its lens's column.
Weaving what comes out looks the same codes up again, so it gives the panel image back bit for bit,
provided that no two subpixels with different codes met in one view pixel (`Unwoven.collisions`).
They never do where views have one row a panel row and a pixel's step is a view or more, that is
views·lens_count ≥ panel width: then a view pixel holds at most one subpixel of each colour. Nor
do they where the image was woven by nearest view from lens-aligned views of as many rows.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import DisplayProfile, ViewGrid
from lfd_render.display.model import MAX_VIEWS
from lfd_render.errors import PictureError, UsageError

Pixels = NDArray[np.uint8]
Bools = NDArray[np.bool_]
Index = NDArray[np.int64]

_BLOCK_ROWS = 64  # panel rows at once, which bounds memory
_EDGE_PX = 8  # cells lie at most 2 pixels from their pixel, so edge lenses begin within 8
_NEIGHBOURS = ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))
_UNGUIDED = 0.02  # weight of a neighbour about whose likeness nothing is known


@dataclass(frozen=True, eq=False)
class Unwoven:
    """Views of a panel image, uint8 [view, row, column, 3], on a lens-aligned grid.

    sampled: the share of view pixels' channels that the panel image holds; the rest is filled in
    from neighbours. collisions: subpixels whose code is not the one that weaving would look up.
    """

    views: Pixels
    grid: ViewGrid
    sampled: float
    collisions: int


def unweave(
    eia: Pixels, profile: DisplayProfile, views: int | None = None, rows: int | None = None
) -> Unwoven:
    """Views of a panel image uint8 [y, x, 3].

    views: how many, the profile's by default. rows: of a view; None takes as many as all views
    together hold the panel's pixels with, or one a panel row where those collide. Raises
    PictureError for an image that is not the panel's size, UsageError for numbers out of range.
    """
    width, height = profile.resolution_px
    if eia.dtype != np.uint8 or eia.shape != (height, width, 3):
        raise PictureError(
            f"panel image is {eia.dtype} {list(eia.shape)}; the display '{profile.name}' takes "
            f"uint8 [{height}, {width}, 3]"
        )
    count = profile.views if views is None else views
    if not 1 <= count <= MAX_VIEWS:
        raise UsageError(f"views is {count}; it should be from 1 to {MAX_VIEWS}")
    if rows is not None and not 1 <= rows <= height:
        raise UsageError(f"rows: {rows} is out of range; use 1 to {height}, the panel's own")
    few = ViewGrid.default_rows(profile, count)
    coarse = _Sampling.of(profile, count, min(few, rows or few))
    pictures, known, collisions = coarse.scattered(eia)
    filled = _filled(pictures, known)
    if rows == coarse.grid.rows or (rows is None and not collisions):
        return Unwoven(filled, coarse.grid, float(known.mean()), collisions)
    fine = _Sampling.of(profile, count, rows or height)
    pictures, known, collisions = fine.scattered(eia)
    _take_unknown(pictures, known, fine.grid, filled, coarse.grid)
    return Unwoven(pictures, fine.grid, float(known.mean()), collisions)


def unwoven_grid(profile: DisplayProfile, views: int, rows: int) -> ViewGrid:
    """The lens-aligned grid of so many rows, with columns for all lenses that some subpixel of a
    row lies under, also where a cell reaches beyond the panel's edge."""
    grid = ViewGrid.lens(profile, rows)
    width, height = profile.resolution_px
    edges = np.unique(np.clip([*range(_EDGE_PX), *range(width - _EDGE_PX, width)], 0, width - 1))
    _, lens = _looked_up(profile, views, edges, np.arange(height))
    starts = grid.first_panel_rows(height)[:-1]
    first = np.minimum.reduceat(lens.min(axis=(1, 2)), starts)
    last = np.maximum.reduceat(lens.max(axis=(1, 2)), starts)
    base = np.minimum(first, grid.row_base)
    return replace(
        grid,
        columns=max(grid.columns, int((last - base).max()) + 1),
        row_base=base.astype(np.int32),
        row_offset=grid.row_offset + (grid.row_base - base),
    )


@dataclass(frozen=True, eq=False)
class _Sampling:
    """Which view pixel each subpixel is looked up in: exactly that of the weave pass."""

    profile: DisplayProfile
    grid: ViewGrid
    views: int

    @staticmethod
    def of(profile: DisplayProfile, views: int, rows: int) -> _Sampling:
        """On the grid of so many rows."""
        return _Sampling(profile, unwoven_grid(profile, views, rows), views)

    def places(self) -> Iterator[tuple[slice, tuple[Index, ...]]]:
        """Panel rows of a block of whole view rows, and the index of their subpixels into views
        [view, row, column, channel]."""
        width, height = self.profile.resolution_px
        starts = self.grid.first_panel_rows(height)
        rows = max(1, _BLOCK_ROWS * self.grid.rows // height)
        for first in range(0, self.grid.rows, rows):
            end = min(first + rows, self.grid.rows)
            y = np.arange(starts[first], starts[end])
            row = np.repeat(np.arange(first, end), np.diff(starts[first : end + 1]))[:, None, None]
            view, lens = _looked_up(self.profile, self.views, np.arange(width), y)
            column = lens - self.grid.row_base[row]
            yield slice(int(starts[first]), int(starts[end])), (view, row, column, np.arange(3))

    def scattered(self, eia: Pixels) -> tuple[Pixels, Bools, int]:
        """Views with each subpixel in its place, which places hold one, and collisions.

        Of several subpixels in one place the last counts.
        """
        shape = (self.views, self.grid.rows, self.grid.columns, 3)
        pictures, known = np.zeros(shape, np.uint8), np.zeros(shape, np.bool_)
        collisions = 0
        for part, place in self.places():
            pictures[place] = eia[part]
            known[place] = True
            collisions += int(np.count_nonzero(pictures[place] != eia[part]))
        return pictures, known, collisions


def _looked_up(profile: DisplayProfile, views: int, x: Index, y: Index) -> tuple[Index, Index]:
    """View and lens of the subpixels at columns x and rows y, [y, x, channel] each."""
    tables = profile.phase_tables()
    fixed = tables.fixed(views)
    phase = tables.fixed_phase(fixed, x, y)
    return fixed.view(phase).astype(np.int64), fixed.lens(phase)


def _filled(pictures: Pixels, known: Bools) -> Pixels:
    """Channels that are not known, estimated from those of neighbouring views, rows and columns.

    Each neighbour proposes its own value, moved by how the pixel's known channels differ from the
    neighbour's, and weighs the more the less they differ. What has no known neighbour waits for
    the next round.
    """
    pictures, known = pictures.copy(), known.copy()
    while True:
        at = np.nonzero(~known)
        if not len(at[0]):
            return pictures
        estimate, weight = _proposed(pictures, known, at)
        got = weight > 0
        if not got.any():
            return pictures  # nothing is known at all
        found = tuple(index[got] for index in at)
        pictures[found] = np.rint(estimate[got])
        known[found] = True


def _proposed(
    pictures: Pixels, known: Bools, at: tuple[Index, ...]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Weighted mean of what the six neighbours propose for each entry, and the sum of weights."""
    *place, channel = at
    entry = np.arange(len(channel))
    own, own_known = pictures[tuple(place)].astype(np.float64), known[tuple(place)]
    total, weights = np.zeros(len(entry)), np.zeros(len(entry))
    for step in _NEIGHBOURS:
        beside = [index + by for index, by in zip(place, step, strict=True)]
        inside = [
            np.clip(index, 0, size - 1)
            for index, size in zip(beside, pictures.shape[:3], strict=True)
        ]
        usable = known[tuple(inside)][entry, channel]
        for index, clipped in zip(beside, inside, strict=True):
            usable = usable & (index == clipped)
        theirs = pictures[tuple(inside)].astype(np.float64)
        both = own_known & known[tuple(inside)]
        shared = both.sum(axis=1)
        differ = np.where(both, own - theirs, 0.0)
        unlike = np.abs(differ).sum(axis=1) / np.maximum(shared, 1)
        weight = np.where(shared > 0, 1 / (1 + unlike), _UNGUIDED) * usable
        proposal = theirs[entry, channel] + differ.sum(axis=1) / np.maximum(shared, 1)
        total += weight * np.clip(proposal, 0, 255)
        weights += weight
    return total / np.maximum(weights, np.finfo(float).tiny), weights


def _take_unknown(
    pictures: Pixels, known: Bools, grid: ViewGrid, coarse: Pixels, coarse_grid: ViewGrid
) -> None:
    """Fill what is not known from views of fewer rows, lens by lens."""
    row_of = np.repeat(
        np.arange(coarse_grid.rows), np.diff(coarse_grid.first_panel_rows(grid.rows))
    )
    lens = grid.row_base[:, None] + np.arange(grid.columns)
    column = np.clip(lens - coarse_grid.row_base[row_of][:, None], 0, coarse_grid.columns - 1)
    for picture, here, source in zip(pictures, known, coarse, strict=True):
        np.copyto(picture, source[row_of[:, None], column], where=~here)

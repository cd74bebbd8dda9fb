"""Subpixel → phase → view, in float64: which view each subpixel of a panel belongs to.

    φ = (u + c/(3W) + v·T)·P − center          u = (x+½)/W, v = (y+½)/H from the bottom
    z = 1 − frac(φ),  view = floor(z·N)         view 0 leftmost

φ is the sum of a column table, a row table and a table of subpixel cells, and of a correction where
the profile has one. Inverted views run the other way: z = frac φ. Where a phase lies on the
boundary of two views, rounding would decide; so views are defined on `FixedPhases`, the same tables
in whole views and 2⁻³² fractions of one, which add without rounding on every device.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lfd_render.display.model import Cells

if TYPE_CHECKING:
    from lfd_render.display.profile import DisplayProfile

Float64 = NDArray[np.float64]
Index = NDArray[np.int64]

_FRACTION_BITS = 32
_BLOCK_ROWS = 64  # phases of a whole 4K panel take 200 MB, those of a block 6 MB
_CACHED_ROWS = 8  # of 8K words, so that sums stay in the cache
_MODE_PERIODS = (1, 2, 1, 4, 2)  # rows after which each CellPatternMode repeats


@dataclass(frozen=True, eq=False)
class PhaseTables:
    """The three tables whose sum is the phase of a subpixel, in lenses.

    Rows count from the top of the picture; cell kinds follow x and y counted from the bottom.
    """

    column: Float64  # [W, 3]
    row: Float64  # [H]
    cell: Float64  # [kind, 3]; one kind of zeros for plain stripes
    pattern_mode: int  # CellPatternMode 0..4
    inverted: bool = False  # views run the other way under a lens
    correction: Float64 | None = None  # [row, column] from corner to corner, added to all channels

    @property
    def size_px(self) -> tuple[int, int]:
        """Panel width and height."""
        return self.column.shape[0], self.row.shape[0]

    def kind_at(self, x: NDArray[np.int64], y: NDArray[np.int64]) -> NDArray[np.int64]:
        """Cell kind of the pixels at column x and row y from the top, broadcast together."""
        y_up = self.row.shape[0] - 1 - y
        x, y_up = np.broadcast_arrays(x, y_up)
        kind: NDArray[np.int64]
        match self.pattern_mode:
            case 1:
                kind = (x + y_up) % 2
            case 2:
                kind = x % 2
            case 3:
                kind = (y_up + 2 * (x % 2)) % 4
            case 4:
                kind = y_up % 2
            case _:
                kind = np.zeros_like(x)
        return kind

    def kinds(self) -> NDArray[np.uint8]:
        """Cell kind of every pixel, [y, x]."""
        width, height = self.size_px
        return self.kind_at(np.arange(width)[None, :], np.arange(height)[:, None]).astype(np.uint8)

    def phase(self, rows: slice = slice(None)) -> Float64:
        """Phase φ of every subpixel of the rows given, [y, x, channel]."""
        width, height = self.size_px
        phase = self.column[None, :, :] + self.row[rows, None, None]
        if len(self.cell) == 1:
            phase += self.cell[0]
        else:
            y = np.arange(height)[rows]
            phase += self.cell[self.kind_at(np.arange(width)[None, :], y[:, None])]
        if self.correction is not None:
            phase += self.correction_at(np.arange(width)[None, :], np.arange(height)[rows, None])[
                ..., None
            ]
        return phase

    def correction_at(self, x: NDArray[np.int64], y: NDArray[np.int64]) -> Float64:
        """Correction of the pixels at column x and row y from the top, broadcast together."""
        assert self.correction is not None
        rows, columns = self.correction.shape
        width, height = self.size_px
        at_x = (x + 0.5) / width * (columns - 1)
        at_y = (y + 0.5) / height * (rows - 1)
        left = np.minimum(at_x.astype(np.int64), columns - 2)
        top = np.minimum(at_y.astype(np.int64), rows - 2)
        across, down = at_x - left, at_y - top
        upper, lower = (
            (1 - across) * self.correction[row, left] + across * self.correction[row, left + 1]
            for row in (top, top + 1)
        )
        mixed: Float64 = (1 - down) * upper + down * lower
        return mixed

    def fixed_correction(self, views: int, rows: slice = slice(None)) -> NDArray[np.int64]:
        """Correction of every pixel of the rows given, [y, x], in the units of `fixed`."""
        width, height = self.size_px
        y = np.arange(height)[rows, None]
        return _fixed(self.correction_at(np.arange(width)[None, :], y), views)

    def phase_at(self, x: NDArray[np.int64], y: NDArray[np.int64]) -> Float64:
        """Phase φ of subpixels, x [..., channel] and y from the top, broadcast together."""
        channel = np.arange(3)
        phase: Float64 = self.column[x, channel] + self.row[y]
        if len(self.cell) == 1:
            phase += self.cell[0]
        else:
            phase += self.cell[self.kind_at(x, y), channel]
        if self.correction is not None:
            phase += self.correction_at(x, y)
        return phase

    @property
    def reach(self) -> float:
        """How far, in lenses, cells and correction move a subpixel from where its column says."""
        corrected = 0.0 if self.correction is None else float(np.abs(self.correction).max())
        return float(np.abs(self.cell).max()) + corrected

    def fixed_phase(self, fixed: FixedPhases, x: Index, y: Index) -> Index:
        """Sums of the fixed tables at columns x and rows y, [y, x, channel]."""
        kinds = self.kind_at(x[None, :], y[:, None])
        phase = fixed.column[None, x, None] + fixed.row[y, None, None] + fixed.subpixel[kinds]
        if self.correction is not None:
            phase += _fixed(self.correction_at(x[None, :], y[:, None]), fixed.views)[..., None]
        return phase

    def fixed(self, views: int) -> FixedPhases:
        """The tables in units of views, without the whole lenses of the first column."""
        lenses = int(np.floor(self.column[0, 0]))
        return FixedPhases(
            views=views,
            lenses=lenses,
            column=_fixed(self.column[:, 0] - lenses, views),
            row=_fixed(self.row, views),
            # Channels differ by the same phase in every column.
            subpixel=_fixed(self.cell + (self.column[0] - self.column[0, 0]), views),
            inverted=self.inverted,
        )

    def view_index_map(self, views: int) -> NDArray[np.uint16]:
        """View of every subpixel, [y, x, channel]."""
        width, height = self.size_px
        fixed = self.fixed(views)
        x = np.arange(width)
        index = np.empty((height, width, 3), np.uint16)
        if self.correction is not None:
            for rows in _blocks(height):
                index[rows] = fixed.view(self.fixed_phase(fixed, x, np.arange(height)[rows]))
            return index
        period = _MODE_PERIODS[self.pattern_mode]
        for first in range(min(period, height)):
            kinds = self.kind_at(x, np.full(1, first))
            columns = (fixed.column[:, None] + fixed.subpixel[kinds]).reshape(-1)
            rows_alike = index.reshape(height, 3 * width)[first::period]
            _sum_views(columns, fixed.row[first::period], fixed, rows_alike)
        return index


@dataclass(frozen=True, eq=False)
class FixedPhases:
    """Phases as integers: φ·views·2³², less `lenses` whole lenses. Sums are exact.

    column int64 [W], row int64 [H], subpixel int64 [kind, channel], which holds what channels
    and cells add to a pixel.
    """

    views: int
    lenses: int
    column: NDArray[np.int64]
    row: NDArray[np.int64]
    subpixel: NDArray[np.int64]
    inverted: bool = False

    def view(self, phase: NDArray[np.int64]) -> NDArray[np.uint16]:
        """View ⌊(1 − frac φ)·N⌋ of summed phases, clamped to N − 1 where frac φ is 0.

        Where views are inverted it is ⌊frac φ·N⌋.
        """
        within: NDArray[np.int64] = phase % (self.views << _FRACTION_BITS)
        if self.inverted:
            return (within >> _FRACTION_BITS).astype(np.uint16)
        ahead = -(
            -within >> _FRACTION_BITS
        )  # rounded up: a phase on a boundary is in the view below
        index: NDArray[np.int64] = np.minimum(self.views - ahead, self.views - 1)
        return index.astype(np.uint16)

    def lens(self, phase: NDArray[np.int64]) -> NDArray[np.int64]:
        """Lens ⌊φ⌋ of summed phases."""
        found: NDArray[np.int64] = phase // (self.views << _FRACTION_BITS) + self.lenses
        return found


def _sum_views(columns: Index, rows: Index, fixed: FixedPhases, out: NDArray[np.uint16]) -> None:
    """View of each column's phase plus each row's, into out [row, column], by short words.

    ⌊(1 − frac φ)·N⌋ is the whole part of −φ in views, within a lens; only where φ is a whole lens
    is it not, since that belongs to the last view.
    """
    lens = fixed.views << _FRACTION_BITS
    sign = 1 if fixed.inverted else -1
    columns, rows = sign * columns % lens, sign * rows % lens
    views = np.uint16(fixed.views)
    column_whole, column_part = _words(columns)
    row_whole, row_part = _words(rows)
    for start in range(0, len(rows), _CACHED_ROWS):
        part = slice(start, start + _CACHED_ROWS)
        fraction = column_part[None, :] + row_part[part, None]
        whole = column_whole[None, :] + row_whole[part, None]
        whole += fraction < column_part[None, :]  # the carry
        np.minimum(whole, whole - views, out=out[part])  # less a lens; below 0 is beyond 65,000
    if not fixed.inverted:
        for row in np.flatnonzero(np.isin(-rows % lens, columns)):
            out[row, columns == -rows[row] % lens] = fixed.views - 1


def _words(phases: Index) -> tuple[NDArray[np.uint16], NDArray[np.uint32]]:
    """Whole views and the fraction of a view."""
    return (phases >> _FRACTION_BITS).astype(np.uint16), phases.astype(np.uint32)


def _fixed(phases: Float64, views: int) -> NDArray[np.int64]:
    in_views = phases * views
    whole = np.floor(in_views)
    fraction = np.rint((in_views - whole) * 2.0**_FRACTION_BITS)
    return (whole.astype(np.int64) << _FRACTION_BITS) + fraction.astype(np.int64)


def phase_tables(profile: DisplayProfile) -> PhaseTables:
    """Phase tables of a profile (formula in this module's head)."""
    width, height = profile.resolution_px
    count, drift, subpixels = profile.lens_count, profile.drift, profile.panel.subpixels
    u = (np.arange(width) + 0.5) / width
    v = (np.arange(height)[::-1] + 0.5) / height
    stripe_px, cell, mode = np.zeros(3), np.zeros((1, 3)), 0
    if isinstance(subpixels, Cells):
        offsets = np.array(subpixels.offsets_px)  # [kind, channel, xy]
        cell = (offsets[..., 0] / width + offsets[..., 1] / height * drift) * count
        mode = subpixels.pattern_mode
    elif subpixels.axis == "right":
        stripe_px = np.array(subpixels.offsets_px())
    else:
        cell = (np.array([subpixels.offsets_px()]) / height * drift) * count
    column = (u[:, None] + stripe_px / width) * count - profile.center
    stated = profile.correction
    correction = None if stated is None else np.array(stated.phase_lenses, np.float64)
    return PhaseTables(column, v * drift * count, cell, mode, profile.viewing.inverted, correction)


def view_index(phase: Float64, views: int, *, inverted: bool = False) -> NDArray[np.uint16]:
    """View of each phase: floor(z·N), clamped to N−1 where frac φ is 0; z as in the module."""
    within = phase - np.floor(phase)
    z = within if inverted else 1.0 - within
    return np.minimum(np.floor(z * views), views - 1).astype(np.uint16)


def _blocks(height: int) -> Iterator[slice]:
    return (slice(y, min(y + _BLOCK_ROWS, height)) for y in range(0, height, _BLOCK_ROWS))

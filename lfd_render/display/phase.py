"""Subpixel → phase → view, in float64: which view each subpixel of a panel belongs to.

    φ = (u + c/(3W) + v·T)·P − center          u = (x+½)/W, v = (y+½)/H from the bottom
    z = 1 − frac(φ),  view = floor(z·N)         view 0 leftmost

φ is the sum of a column table, a row table and a table of subpixel cells. Where a phase lies on the
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

_FRACTION_BITS = 32
_BLOCK_ROWS = 64  # phases of a whole 4K panel take 200 MB, those of a block 6 MB


@dataclass(frozen=True, eq=False)
class PhaseTables:
    """The three tables whose sum is the phase of a subpixel, in lenses.

    Rows count from the top of the picture; cell kinds follow x and y counted from the bottom.
    """

    column: Float64  # [W, 3]
    row: Float64  # [H]
    cell: Float64  # [kind, 3]; one kind of zeros for plain stripes
    pattern_mode: int  # CellPatternMode 0..4

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
        return phase

    def phase_at(self, x: NDArray[np.int64], y: NDArray[np.int64]) -> Float64:
        """Phase φ of subpixels, x [..., channel] and y from the top, broadcast together."""
        channel = np.arange(3)
        phase: Float64 = self.column[x, channel] + self.row[y]
        if len(self.cell) == 1:
            phase += self.cell[0]
        else:
            phase += self.cell[self.kind_at(x, y), channel]
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
        )

    def view_index_map(self, views: int) -> NDArray[np.uint16]:
        """View of every subpixel, [y, x, channel]."""
        width, height = self.size_px
        fixed = self.fixed(views)
        x = np.arange(width)
        index = np.empty((height, width, 3), np.uint16)
        for rows in _blocks(height):
            y = np.arange(height)[rows]
            kinds = self.kind_at(x[None, :], y[:, None])
            phase = fixed.column[None, :, None] + fixed.row[y, None, None] + fixed.subpixel[kinds]
            index[rows] = fixed.view(phase)
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

    def view(self, phase: NDArray[np.int64]) -> NDArray[np.uint16]:
        """View ⌊(1 − frac φ)·N⌋ of summed phases, clamped to N − 1 where frac φ is 0."""
        within: NDArray[np.int64] = phase % (self.views << _FRACTION_BITS)
        ahead = -(
            -within >> _FRACTION_BITS
        )  # rounded up: a phase on a boundary is in the view below
        index: NDArray[np.int64] = np.minimum(self.views - ahead, self.views - 1)
        return index.astype(np.uint16)

    def lens(self, phase: NDArray[np.int64]) -> NDArray[np.int64]:
        """Lens ⌊φ⌋ of summed phases."""
        found: NDArray[np.int64] = phase // (self.views << _FRACTION_BITS) + self.lenses
        return found


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
    if isinstance(subpixels, Cells):
        stripe_px = np.zeros(3)
        offsets = np.array(subpixels.offsets_px)  # [kind, channel, xy]
        cell = (offsets[..., 0] / width + offsets[..., 1] / height * drift) * count
        mode = subpixels.pattern_mode
    else:
        stripe_px = np.array(subpixels.offsets_px())
        cell, mode = np.zeros((1, 3)), 0
    column = (u[:, None] + stripe_px / width) * count - profile.center
    return PhaseTables(column, v * drift * count, cell, mode)


def view_index(phase: Float64, views: int) -> NDArray[np.uint16]:
    """View of each phase: floor((1 − frac φ)·N), clamped to N−1 where frac φ is 0."""
    z = 1.0 - (phase - np.floor(phase))
    return np.minimum(np.floor(z * views), views - 1).astype(np.uint16)


def _blocks(height: int) -> Iterator[slice]:
    return (slice(y, min(y + _BLOCK_ROWS, height)) for y in range(0, height, _BLOCK_ROWS))

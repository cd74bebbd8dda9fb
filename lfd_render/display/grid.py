"""Where the pixel centres of a view lie on the panel window: upright, or following the lenses.

A lens-aligned grid has one column per lens: λ = (u + v·T)·P − center at the centre of the row,
column c covering λ from row_base + c to row_base + c + 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from lfd_render.errors import UsageError

if TYPE_CHECKING:
    from lfd_render.display.profile import DisplayProfile

Float64 = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ViewGrid:
    """Sampling grid of a view: column = x_mm/column_mm + row_offset[row], centres at c + ½."""

    rows: int
    columns: int
    column_mm: float  # width of a column along x on the window
    row_offset: Float64  # [rows], column coordinate of window x = 0
    row_base: NDArray[np.int32]  # [rows], lens index of column 0; 0 when upright
    kind: Literal["lens", "upright"]
    panel_mm: tuple[float, float]
    fineness: int = 1  # columns and rows where the grid that this one refines has one

    @staticmethod
    def upright(profile: DisplayProfile, columns: int, rows: int) -> ViewGrid:
        """Plain columns × rows pixels over the window."""
        for name, value in (("columns", columns), ("rows", rows)):
            if value < 1:
                raise UsageError(f"view size: {name} is {value}; it should be at least 1")
        column_mm = profile.size_mm[0] / columns
        row_offset = np.full(rows, columns / 2)
        row_base = np.zeros(rows, np.int32)
        return ViewGrid(rows, columns, column_mm, row_offset, row_base, "upright", profile.size_mm)

    @staticmethod
    def lens(profile: DisplayProfile, rows: int) -> ViewGrid:
        """One column per lens, each row starting at the lens that its left end lies in."""
        left, right = _lambda_at_ends(profile, rows)
        base = np.floor(left)
        return _lens_grid(profile, base, left, int(np.max(np.ceil(right) - base)))

    @staticmethod
    def sheared(profile: DisplayProfile, rows: int) -> ViewGrid:
        """The sampling positions of `lens`, with one base for all rows: a linear shear.

        Column c of `lens` on a row is column c + (lens.row_base − sheared.row_base) here.
        """
        left, right = _lambda_at_ends(profile, rows)
        base = np.full(rows, np.floor(left.min()))
        return _lens_grid(profile, base, left, int(np.ceil(right.max()) - base[0]))

    @staticmethod
    def default_rows(profile: DisplayProfile, views: int) -> int:
        """Rows with which all views together hold as many pixels as the panel.

        Never more than the panel's own rows.
        """
        width, height = profile.resolution_px
        rows = round(width * height / (views * int(np.ceil(profile.lens_count))))
        return min(max(rows, 1), height)

    def finer(self, profile: DisplayProfile, times: int) -> ViewGrid:
        """So many columns and rows for one of this grid; fine rows follow the lenses by themselves.

        Column c of this grid holds the columns from c·times on in all of its fine rows.
        """
        if times == 1:
            return self
        assert self.fineness == 1
        rows = self.rows * times
        base = np.repeat(self.row_base, times)
        if self.kind == "upright":
            offset = np.full(rows, self.row_offset[0] * times)
        else:
            left, _ = _lambda_at_ends(profile, rows)
            offset = (left + profile.lens_count / 2 - base) * times
        return ViewGrid(
            rows, self.columns * times, self.column_mm / times, offset, base, self.kind,
            self.panel_mm, times,
        )  # fmt: skip

    def columns_at(self, profile: DisplayProfile) -> tuple[float, Float64]:
        """Where the window's u lies in a row: column = scale·P·u + offset[row], as (scale, offset).

        scale is columns a lens.
        """
        scale = profile.size_mm[0] / profile.lens_count / self.column_mm
        return scale, self.row_offset - 0.5 * profile.size_mm[0] / self.column_mm

    def first_panel_rows(self, height: int) -> NDArray[np.int64]:
        """First panel row whose centre lies in each row of the view, [rows + 1]; ends with height.

        Panel row y belongs to view row floor((y+½)·rows/height).
        """
        edges = 2 * np.arange(self.rows + 1, dtype=np.int64) * height - self.rows
        return -(-edges // (2 * self.rows))

    def row_mm(self) -> Float64:
        """Window y of the row centres, [rows], top row first."""
        return (0.5 - (np.arange(self.rows) + 0.5) / self.rows) * self.panel_mm[1]


def _lambda_at_ends(profile: DisplayProfile, rows: int) -> tuple[Float64, Float64]:
    """λ at the window's left and right edge on the centre of each row."""
    if rows < 1:
        raise UsageError(f"view size: rows is {rows}; it should be at least 1")
    v = 1 - (np.arange(rows) + 0.5) / rows
    left = v * profile.drift * profile.lens_count - profile.center
    return left, left + profile.lens_count


def _lens_grid(profile: DisplayProfile, base: Float64, left: Float64, columns: int) -> ViewGrid:
    count, panel_mm = profile.lens_count, profile.size_mm
    row_offset = left + count / 2 - base
    row_base = base.astype(np.int32)
    return ViewGrid(len(base), columns, panel_mm[0] / count, row_offset, row_base, "lens", panel_mm)

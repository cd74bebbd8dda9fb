"""View grids: lens-aligned columns stand on the lenses, sheared ones on the same positions."""

import numpy as np
import pytest

from lfd_render.display import DisplayProfile, ViewGrid, shipped_profiles
from lfd_render.errors import UsageError

NAMES = shipped_profiles()


def centres_mm(grid: ViewGrid) -> np.ndarray:
    """Window x of every pixel centre, [row, column]."""
    return (np.arange(grid.columns) + 0.5 - grid.row_offset[:, None]) * grid.column_mm


@pytest.mark.parametrize("name", NAMES)
def test_lens_columns_are_lens_centres(name: str) -> None:
    profile = DisplayProfile.load(name)
    grid = ViewGrid.lens(profile, 100)
    lens = grid.row_base[:, None] + np.arange(grid.columns)
    v = grid.row_mm()[:, None] / profile.size_mm[1] + 0.5
    u = (lens + 0.5 + profile.center) / profile.lens_count - v * profile.drift
    assert centres_mm(grid) == pytest.approx((u - 0.5) * profile.size_mm[0], abs=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_sheared_grid_has_the_positions_of_the_lens_grid(name: str) -> None:
    profile = DisplayProfile.load(name)
    lens, sheared = ViewGrid.lens(profile, 100), ViewGrid.sheared(profile, 100)
    assert len(set(sheared.row_base.tolist())) == 1
    shift = lens.row_base - sheared.row_base
    assert shift.min() == 0
    assert (shift + lens.columns).max() <= sheared.columns + 1
    columns = shift[:, None] + np.arange(lens.columns)
    x_mm = (columns + 0.5 - sheared.row_offset[:, None]) * sheared.column_mm
    assert x_mm == pytest.approx(centres_mm(lens), abs=1e-9)
    # One shear for all rows: the offset is linear in the row.
    assert np.diff(sheared.row_offset, 2) == pytest.approx(np.zeros(98), abs=1e-9)


@pytest.mark.parametrize("make", [ViewGrid.lens, ViewGrid.sheared])
@pytest.mark.parametrize("name", NAMES)
def test_columns_cover_the_window_and_no_more(name: str, make: type[ViewGrid.lens]) -> None:
    profile = DisplayProfile.load(name)
    grid = make(profile, 100)
    half = profile.size_mm[0] / 2
    left = (0 - grid.row_offset) * grid.column_mm
    right = (grid.columns - grid.row_offset) * grid.column_mm
    assert (left <= -half + 1e-9).all()
    assert (right >= half - 1e-9).all()
    assert left.max() > -half - grid.column_mm
    assert right.min() < half + grid.column_mm
    assert grid.kind == "lens"


@pytest.mark.parametrize("name", NAMES)
def test_weaving_finds_a_column_for_every_subpixel(name: str) -> None:
    profile = DisplayProfile.load(name)
    grid = ViewGrid.lens(profile, ViewGrid.default_rows(profile, 48))
    height = profile.resolution_px[1]
    starts = grid.first_panel_rows(height)
    row = np.repeat(np.arange(grid.rows), np.diff(starts))
    assert (row == np.floor((np.arange(height) + 0.5) * grid.rows / height)).all()
    lens = np.floor(profile.phase_map()[:, ::97])
    column = lens - grid.row_base[row][:, None, None]
    # Panel rows above and below a row's centre, and stripes right of a pixel's, may lie in the
    # lens beside the grid's first or last.
    assert column.min() >= -1
    assert column.max() <= grid.columns
    assert np.mean((column < 0) | (column >= grid.columns)) < 0.01


def test_upright_grid_is_plain_pixels() -> None:
    grid = ViewGrid.upright(DisplayProfile.load("gavane-2024-tilted-4k"), 480, 360)
    assert centres_mm(grid)[0] == pytest.approx(((np.arange(480) + 0.5) / 480 - 0.5) * 345.4)
    assert grid.row_mm() == pytest.approx((0.5 - (np.arange(360) + 0.5) / 360) * 194.3)
    assert not grid.row_base.any()
    assert grid.kind == "upright"


def test_default_rows_hold_the_panels_pixels() -> None:
    paper = DisplayProfile.load("gavane-2024-tilted-4k")
    assert ViewGrid.default_rows(paper, 48) == 360
    assert ViewGrid.lens(paper, 360).columns in {480, 481}
    assert ViewGrid.default_rows(paper, 1) == 2160  # never more than the panel's own
    assert ViewGrid.default_rows(paper, 4096) == 4


def test_empty_grids_are_refused() -> None:
    paper = DisplayProfile.load("gavane-2024-tilted-4k")
    for make in (ViewGrid.lens, ViewGrid.sheared):
        with pytest.raises(UsageError, match="rows is 0"):
            make(paper, 0)
    with pytest.raises(UsageError, match="columns is 0"):
        ViewGrid.upright(paper, 0, 4)

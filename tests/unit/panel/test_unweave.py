"""Unweaving: every subpixel back in its place, so that weaving gives the panel image again."""

import dataclasses
import json

import numpy as np
import pytest
from numpy.typing import NDArray

from lfd_render.display import DisplayProfile, ViewGrid
from lfd_render.errors import PictureError, UsageError
from lfd_render.panel.unweave import unweave, unwoven_grid
from lfd_render.reference.weave import woven

SIZE = (96, 64)


def small(pattern_mode: int | None = None, lens_count: float = 11.3) -> DisplayProfile:
    """96 × 64 pixels with stripes, or with a pattern of cells up to 2 pixels away."""
    subpixels: dict[str, object] = {"layout": "stripe", "order": "rgb"}
    subpixels["origin"] = "red-at-pixel-centre"
    if pattern_mode is not None:
        rng = np.random.default_rng(pattern_mode)
        offsets = rng.uniform(-2, 2, (4, 3, 2)).round(3).tolist()
        subpixels = {"layout": "cells", "pattern_mode": pattern_mode, "offsets_px": offsets}
    data = {
        "schema": "lfd-display/1",
        "name": "small",
        "panel": {"resolution_px": SIZE, "size_mm": SIZE, "subpixels": subpixels},
        "lens": {"lens_count": lens_count, "drift": -0.21, "center": 0.37},
        "viewing": {"views": 9, "cone_deg": 40.0, "distance_mm": 300.0},
    }
    return DisplayProfile.from_json(json.dumps(data))


def noise(seed: int = 0) -> NDArray[np.uint8]:
    return np.random.default_rng(seed).integers(0, 256, (SIZE[1], SIZE[0], 3), dtype=np.uint8)


@pytest.mark.parametrize("mode", [None, 0, 1, 2, 3, 4])
@pytest.mark.parametrize("views", [9, 48])
def test_any_panel_image_weaves_back(mode: int | None, views: int) -> None:
    profile, eia = small(mode), noise()
    found = unweave(eia, profile, views)
    assert found.views.shape == (views, found.grid.rows, found.grid.columns, 3)
    again = woven(found.views, profile, found.grid)
    if mode in (None, 0):
        # A pixel is a view or more wide, so no two subpixels of a colour meet.
        assert (found.collisions, found.grid.rows) == (0, SIZE[1])
        np.testing.assert_array_equal(again, eia)
    else:
        # Neighbours of other kinds may lie closer than a view: exactly so many come back wrong.
        assert np.count_nonzero(again != eia) == found.collisions


def test_views_of_as_many_rows_come_back_themselves() -> None:
    """What the panel image holds of its views is exact; only the rest is estimated."""
    profile = small()
    grid = ViewGrid.lens(profile, 16)
    views = np.random.default_rng(3).integers(0, 256, (9, 16, grid.columns, 3), dtype=np.uint8)
    found = unweave(woven(views, profile, grid).astype(np.uint8), profile, 9, rows=16)
    assert found.collisions == 0
    base = grid.row_base - found.grid.row_base
    same = [
        found.views[:, row, base[row] : base[row] + grid.columns] == views[:, row]
        for row in range(16)
    ]
    # By chance an estimate is right now and then.
    assert 0 <= np.sum(same) / found.views.size - found.sampled < 0.01
    assert found.sampled > 0.8


def test_colliding_subpixels_are_counted_where_rows_are_asked_for() -> None:
    found = unweave(noise(), small(), 9, rows=16)
    assert found.grid.rows == 16
    again = woven(found.views, small(), found.grid)
    assert np.count_nonzero(again != noise()) == found.collisions > 0


@pytest.mark.parametrize("rows", [1, 5, 40, 63, 64])
def test_any_number_of_rows_may_be_asked_for(rows: int) -> None:
    """Beyond the default rows most view pixels are not in the panel image; none is left out."""
    ramp = (77 + np.arange(SIZE[1])).astype(np.uint8)[:, None, None]
    found = unweave(np.broadcast_to(ramp, (SIZE[1], SIZE[0], 3)), small(), 9, rows)
    assert found.grid.rows == rows
    assert found.views.min() >= 77
    across = found.views.mean(axis=(0, 2, 3))
    # Row by row the panel rows it stands for, or those around.
    assert np.abs(across - (77 + (np.arange(rows) + 0.5) * 64 / rows)).max() < max(8, 34 / rows)


def test_too_few_views_collide() -> None:
    found = unweave(noise(), small(), 4)  # a pixel is half a view wide
    assert found.grid.rows == SIZE[1]
    assert found.collisions > 0


@pytest.mark.parametrize("mode", [None, 1, 3])
@pytest.mark.parametrize("rows", [1, 7, 64])
def test_the_grid_holds_every_lens(mode: int | None, rows: int) -> None:
    profile = small(mode)
    grid = unwoven_grid(profile, 9, rows)
    lens = np.floor(profile.phase_map())
    column = lens - grid.row_base[(np.arange(64) * 2 + 1) * rows // 128][:, None, None]
    assert column.min() >= 0
    assert column.max() <= grid.columns - 1
    plain = ViewGrid.lens(profile, rows)
    # Its columns are where those of the plain grid are, more of them at the ends at most.
    np.testing.assert_allclose(
        grid.row_offset + grid.row_base, plain.row_offset + plain.row_base, rtol=0, atol=1e-12
    )
    assert (grid.row_base <= plain.row_base).all()


def test_smooth_views_are_filled_in_smoothly() -> None:
    profile = small()
    grid = ViewGrid.lens(profile, 16)
    view, row, column = np.ogrid[:9, :16, : grid.columns]
    light = 60 + 4 * view + 3 * row + 5 * (column + grid.row_base[:, None])
    views = np.clip(light[..., None] * [1.0, 0.9, 0.7], 0, 255).astype(np.uint8)
    found = unweave(woven(views, profile, grid).astype(np.uint8), profile, 9, rows=16)
    base = grid.row_base - found.grid.row_base
    apart = [
        np.abs(
            found.views[:, r, base[r] : base[r] + grid.columns].astype(int) - views[:, r]
        )[:, 1:-1]
        for r in range(16)
    ]  # fmt: skip
    # A neighbour differs by up to 5 and its neighbour by 10, where no colour of the pixel is known.
    assert np.max(apart) <= 10
    assert np.mean(apart) < 0.1


def test_a_plain_panel_gives_plain_views() -> None:
    eia = np.full((SIZE[1], SIZE[0], 3), (200, 30, 5), np.uint8)
    for rows in (None, 4, 64):
        found = unweave(eia, small(), 9, rows)
        assert (found.views == (200, 30, 5)).all()


def test_bad_requests_are_named() -> None:
    profile = small()
    with pytest.raises(PictureError, match=r"panel image is uint8 \[64, 95, 3\]"):
        unweave(noise()[:, :-1], profile)
    with pytest.raises(PictureError, match="panel image is float64"):
        unweave(noise().astype(float), profile)  # type: ignore[arg-type]
    for rows in (0, 65):
        with pytest.raises(UsageError, match=f"rows: {rows} is out of range; use 1 to 64"):
            unweave(noise(), profile, rows=rows)
    with pytest.raises(UsageError, match="views is 0"):
        unweave(noise(), profile, 0)


def test_a_lens_off_by_one_does_not_weave_back() -> None:
    """The planted fault: views of a display whose centre is a tenth of a lens away."""
    profile = small()
    found = unweave(noise(), profile, 48)
    other = profile.model_copy(update={"lens": profile.lens.model_copy(update={"center": 0.47})})
    assert np.count_nonzero(woven(found.views, other, found.grid) != noise()) > 1000
    assert dataclasses.replace(found, collisions=1).collisions == 1

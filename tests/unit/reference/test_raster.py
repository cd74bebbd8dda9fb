"""Visibility by its definition, where the answer is plain."""

import dataclasses

import numpy as np
import pytest
from numpy.typing import NDArray

from lfd_render.display import Rig, ViewGrid
from lfd_render.reference import NO_TRIANGLE, Pixels, placed, raster, visible
from lfd_render.reference.raster import boundary_distance, covers, meet, near_part, rays
from lfd_render.scene import Material

from .scenes import DISTANCE_MM, mesh_of, scene_of, square, triangles_of, views


def centres(grid: ViewGrid) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Window x [column] and y [row] of an upright grid's pixel centres."""
    x = (np.arange(grid.columns) + 0.5) * grid.column_mm - 0.5 * grid.panel_mm[0]
    return x, grid.row_mm()


def all_pixels(rig: Rig, grid: ViewGrid) -> Pixels:
    return Pixels(*np.ogrid[: grid.rows, : rig.views, : grid.columns])


# ---- where things appear ----------------------------------------------------------------------


@pytest.mark.parametrize("z", [-300.0, -40.0, 0.0, 100.0, 256.0])
def test_a_square_moves_by_the_shear(z: float) -> None:
    """Its sides appear at k·X + (1 − k)·s, and stay in their rows."""
    rig, grid = views()
    shown = visible(triangles_of(square(61.0, z, (7.0, 3.0))), rig, grid)
    k = DISTANCE_MM / (DISTANCE_MM - z)
    x, y = centres(grid)
    for view, eye in enumerate(rig.eye_x_mm):
        left, right = (k * (7.0 + side * 30.5) + (1 - k) * eye for side in (-1, 1))
        low, high = (k * (3.0 + side * 30.5) for side in (-1, 1))
        expected = (x >= left) & (x < right) & (y > low)[:, None] & (y <= high)[:, None]
        np.testing.assert_array_equal(shown.ids[:, view] != NO_TRIANGLE, expected)
        np.testing.assert_allclose(shown.depths[:, view][expected], DISTANCE_MM - z)
    assert np.all(np.isinf(shown.depths[shown.ids == NO_TRIANGLE]))


def test_what_lies_in_the_panel_stays_put() -> None:
    rig, grid = views()
    ids = visible(triangles_of(square(61.0, 0.0)), rig, grid).ids
    assert np.all(ids == ids[:, :1])


def test_grids_along_lenses_only_shift_rows() -> None:
    rig, grid = views()
    shift = np.arange(grid.rows) % 5
    sheared = dataclasses.replace(grid, row_offset=grid.row_offset - shift)
    triangles = triangles_of(square(61.0, 50.0))
    straight, moved = (visible(triangles, rig, g).ids for g in (grid, sheared))
    for row, by in enumerate(shift):
        np.testing.assert_array_equal(moved[row, :, : 64 - by], straight[row, :, by:])


# ---- which side, how near ---------------------------------------------------------------------


def test_only_the_side_that_faces_is_drawn() -> None:
    rig, grid = views()
    front, back = square(61.0, 0.0), square(61.0, 0.0)[:, ::-1]
    assert np.any(visible(triangles_of(front), rig, grid).ids != NO_TRIANGLE)
    assert np.all(visible(triangles_of(back), rig, grid).ids == NO_TRIANGLE)
    both = visible(triangles_of(back, double_sided=True), rig, grid)
    assert np.any(both.ids != NO_TRIANGLE)
    mirrored = dataclasses.replace(triangles_of(back), mirrored=np.array([True, True]))
    assert np.any(visible(mirrored, rig, grid).ids != NO_TRIANGLE)


def test_a_triangle_may_face_some_views_only() -> None:
    """A wall in the plane x = 10 faces the eyes to its right."""
    rig, grid = views()
    wall = np.array([[[10.0, -50, -200], [10, 50, 100], [10, 50, -200]]])
    seen = np.any(visible(triangles_of(wall), rig, grid).ids != NO_TRIANGLE, axis=(0, 2))
    other = np.any(visible(triangles_of(wall[:, ::-1]), rig, grid).ids != NO_TRIANGLE, axis=(0, 2))
    np.testing.assert_array_equal(rig.eye_x_mm > 10.0, other)
    np.testing.assert_array_equal(rig.eye_x_mm < 10.0, seen)


def test_near_parts_and_what_is_behind_the_viewer_are_not_seen() -> None:
    rig, grid = views()
    # A floor from far behind the panel to far behind the viewer.
    floor = np.array([[[-1e4, -30, 2e3], [1e4, -30, 2e3], [0, -30, -2e4]]])
    shown = visible(triangles_of(floor), rig, grid)
    depths = shown.depths[shown.ids == 0]
    # A ray to window height y < 0 meets the floor at d = D·30/|y|.
    _, y = centres(grid)
    np.testing.assert_array_equal(np.any(shown.ids == 0, axis=(1, 2)), y < 0)
    np.testing.assert_allclose(shown.depths[y < 0, 1, 32], DISTANCE_MM * 30 / -y[y < 0], rtol=1e-12)
    assert depths.min() >= rig.near_mm
    assert np.all(visible(triangles_of(square(9e3, 600.0)), rig, grid).ids == NO_TRIANGLE)
    closer = dataclasses.replace(rig, near_mm=400.0)
    assert np.count_nonzero(visible(triangles_of(floor), closer, grid).ids == 0) < len(depths)


def test_the_nearest_wins_and_of_two_alike_the_first() -> None:
    rig, grid = views()
    stack = np.concatenate([square(90.0, z) for z in (0.0, 40.0, 40.0, -50.0)])
    ids = visible(triangles_of(stack), rig, grid).ids
    x, y = centres(grid)
    middle = ids[np.abs(y) < 40][:, 1][:, np.abs(x) < 40]
    assert set(np.unique(middle)) == {2, 3}


def test_blended_surfaces_lie_over_solid_ones() -> None:
    rig, grid = views()
    materials = (Material("glass", alpha_mode="blend"), Material("solid"))
    meshes = [
        mesh_of(square(90.0, z), kind) for z, kind in ((0.0, 1), (0.0, 0), (60.0, 0), (-9, 0))
    ]
    triangles = placed(scene_of(*meshes, materials=materials), np.eye(4))
    np.testing.assert_array_equal(triangles.blended, [False] * 2 + [True] * 6)
    solid = visible(triangles, rig, grid)
    blended = visible(triangles, rig, grid, over=solid)
    assert solid.ids[16, 1, 32] < 2
    assert blended.ids[16, 1, 32] in (4, 5)  # the near pane
    only = dataclasses.replace(triangles, blended=np.array([False] * 4 + [True] * 4))
    level = visible(dataclasses.replace(only, blended=~only.blended), rig, grid)
    assert level.ids[16, 1, 32] in (4, 5)
    # At the same depth glass lies over, behind it does not show.
    panes = triangles.p_display[:4]
    over = dataclasses.replace(triangles_of(panes), blended=np.array([False, False, True, True]))
    assert visible(over, rig, grid, over=visible(over, rig, grid)).ids[16, 1, 32] in (2, 3)


# ---- the coverage rule ------------------------------------------------------------------------


def times_covered(corners: NDArray[np.float64]) -> NDArray[np.int64]:
    rig, grid = views()
    triangles = triangles_of(corners, double_sided=True)
    counted = np.zeros((grid.rows, rig.views, grid.columns), int)
    for index in range(len(triangles)):
        meeting = meet(corners[index], rays(rig, grid, all_pixels(rig, grid)), DISTANCE_MM)
        counted += covers(meeting, triangles, index, rig.near_mm)
    return counted


def fan(rng: np.random.Generator, z: float) -> NDArray[np.float64]:
    """Triangles about a pixel's centre whose outer corners lie on pixel centres too: all ties."""
    k = DISTANCE_MM / (DISTANCE_MM - z)
    around = [(-30, -26), (2, -26), (34, -26), (34, 6), (34, 38), (2, 38), (-30, 38), (-30, 6)]
    outer = np.array([(x, y, z * k) for x, y in around]) / k
    centre = np.array([2.0 + 4 * rng.integers(-3, 4), 6.0 + 4 * rng.integers(-3, 4), z * k]) / k
    after = np.roll(outer, -1, axis=0)
    return np.stack([np.broadcast_to(centre, outer.shape), outer, after], axis=1)


@pytest.mark.parametrize("z", [0.0, 256.0, -512.0])
def test_triangles_that_meet_share_no_pixel_and_leave_none(
    rng: np.random.Generator, z: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    counted = times_covered(fan(rng, z))
    assert set(np.unique(counted)) == {0, 1}
    assert counted[:, 1].sum() == 16 * 16  # of 64 × 64 mm in pixels of 4 mm, at any depth

    def closed(meeting: raster.Meeting) -> NDArray[np.bool_]:
        return np.all(meeting.volumes * np.sign(meeting.whole)[..., None] >= 0, axis=-1)

    monkeypatch.setattr(raster, "inside", closed)
    assert times_covered(fan(rng, z)).max() > 1


def test_left_and_upper_edges_are_inside() -> None:
    """A square whose sides run through pixel centres."""
    rig, grid = views()
    ids = visible(triangles_of(square(32.0, 0.0, (2.0, 2.0))), rig, grid).ids[:, 1]
    rows, columns = np.nonzero(ids != NO_TRIANGLE)
    x, y = centres(grid)
    assert (x[columns.min()], x[columns.max()]) == (-14.0, 14.0)  # of −14 … 18
    assert (y[rows.max()], y[rows.min()]) == (-10.0, 18.0)  # of −14 … 18; row spacing is 4 mm


def test_coverage_is_that_of_the_picture_of_the_near_part(rng: np.random.Generator) -> None:
    """Against a polygon cut at the near plane and projected, tested by its edges in the picture."""
    rig, grid = views()
    x, y = centres(grid)
    tested = 0
    for _ in range(60):
        corners = rng.uniform((-300, -200, -300), (300, 200, 700), (3, 3))
        triangles = triangles_of(corners[None], double_sided=True)
        corners = triangles.p_display[0]
        polygon = near_part(corners, DISTANCE_MM - rig.near_mm)
        meeting = meet(corners, rays(rig, grid, all_pixels(rig, grid)), DISTANCE_MM)
        found = covers(meeting, triangles, 0, rig.near_mm)
        k = DISTANCE_MM / (DISTANCE_MM - polygon[:, 2])
        for view, eye in enumerate(rig.eye_x_mm):
            seen = np.stack([k * polygon[:, 0] + (1 - k) * eye, k * polygon[:, 1]], axis=1)
            crosses = np.zeros((grid.rows, grid.columns, 0))
            for p, q in zip(seen, np.roll(seen, -1, axis=0), strict=True):
                left = (q[0] - p[0]) * (y[:, None] - p[1]) - (q[1] - p[1]) * (x - p[0])
                crosses = np.concatenate([crosses, left[..., None]], axis=-1)
            expected = np.all(crosses > 0, axis=-1) | np.all(crosses < 0, axis=-1)
            expected &= len(polygon) > 0
            np.testing.assert_array_equal(found[:, view], expected)
            tested += np.count_nonzero(expected)
    assert tested > 1000


def test_looking_only_where_a_triangle_is_changes_nothing(
    rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig, grid = views()
    triangles = triangles_of(
        rng.uniform((-300, -200, -300), (300, 200, 700), (40, 3, 3)), double_sided=True
    )
    quick = visible(triangles, rig, grid)
    everything = (slice(0, grid.rows), slice(0, rig.views), slice(0, grid.columns))
    monkeypatch.setattr(raster, "reach", lambda *_: everything)
    slow = visible(triangles, rig, grid)
    np.testing.assert_array_equal(quick.ids, slow.ids)
    np.testing.assert_array_equal(quick.depths, slow.depths)
    assert np.any(quick.ids != NO_TRIANGLE)
    monkeypatch.setattr(raster, "reach", lambda *_: (slice(8, 24), everything[1], slice(8, 48)))
    assert np.any(visible(triangles, rig, grid).ids != quick.ids)


# ---- distance from edges ----------------------------------------------------------------------


def test_distances_from_the_sides_of_a_square() -> None:
    rig, grid = views()
    corners = square(32.0, 0.0)[0]  # right angle at (16, −16), in pixels of 4 mm
    pixels = Pixels(np.array([16, 16, 30]), np.array([1, 1, 1]), np.array([31, 40, 32]))
    distance, k = boundary_distance(corners, rig, grid, pixels)
    # Centres (−2, −2), (34, −2) and (2, −58) mm from the window's middle.
    np.testing.assert_allclose(distance[0], [3.5, 4.5, 0.0], atol=1e-12)
    np.testing.assert_allclose(distance[1].min(), 4.5)
    np.testing.assert_allclose(distance[2].min(), 10.5)
    np.testing.assert_allclose(k, 1.0)


def test_the_cut_at_the_near_plane_is_an_edge() -> None:
    rig, grid = views()
    corners = np.array([[-1e4, -30.0, 2e3], [1e4, -30, 2e3], [0, -30, -2e4]])
    polygon = near_part(corners, DISTANCE_MM - rig.near_mm)
    assert len(polygon) == 3
    assert polygon[:, 2].max() == DISTANCE_MM - rig.near_mm
    wide = dataclasses.replace(rig, near_mm=300.0)  # the cut appears at y = −30·D/300 = −51.2 mm
    pixels = Pixels(np.array([28]), np.array([1]), np.array([32]))  # centre at y = −50 mm
    distance, k = boundary_distance(corners, wide, grid, pixels)
    np.testing.assert_allclose(distance.min(), 1.2 / 4.0)
    np.testing.assert_allclose(k[0, distance[0].argmin()], DISTANCE_MM / 300.0)


def test_nothing_before_the_near_plane_has_edges() -> None:
    assert near_part(square(9.0, 600.0)[0], 500.0).shape == (0, 3)

"""The row lattice: slices, the densest eye, the length of points, and the pixels they fill."""

import dataclasses

import numpy as np
import pytest
from numpy.typing import NDArray

from lfd_render.display import Rig, ViewGrid
from lfd_render.reference import Pixels, Triangles, points
from lfd_render.reference.culling import areas_px, hash_unit, kept
from lfd_render.reference.points import (
    MOST_COLUMNS,
    PointRow,
    densest_pixel_mm2,
    densest_view,
    eye_sides,
    footprints,
    point_rows,
    slice_mm,
)
from lfd_render.reference.raster import covers, meet, rays
from lfd_render.scene import Image, Material, TextureSlot

from .scenes import DISTANCE_MM, mesh_of, placed, scene_of, square, triangles_of, views


def soup(rng: np.random.Generator, count: int = 80) -> NDArray[np.float64]:
    centre = rng.uniform((-120, -60, -300), (120, 60, 450), (count, 1, 3))
    return centre + rng.normal(size=(count, 3, 3)) * 10.0 ** rng.uniform(-1, 2, (count, 1, 1))


# ---- slices -----------------------------------------------------------------------------------


def test_slices_lie_on_the_rows_plane_and_the_triangles(rng: np.random.Generator) -> None:
    rig, grid = views()
    found = 0
    for corners in soup(rng):
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        for row in range(grid.rows):
            ends = slice_mm(corners, rig, grid, row)
            if ends is None:
                continue
            found += 1
            k = DISTANCE_MM / (DISTANCE_MM - ends[:, 2])
            np.testing.assert_allclose(k * ends[:, 1], grid.row_mm()[row], rtol=1e-6, atol=1e-6)
            off = (ends - corners[0]) @ normal / np.linalg.norm(normal)
            np.testing.assert_allclose(off, 0.0, atol=1e-6)
            assert (DISTANCE_MM - ends[:, 2]).min() >= rig.near_mm - 1e-9
    assert found > 200


def test_slices_end_two_columns_outside_what_any_eye_sees() -> None:
    rig, grid = views()
    wall = np.array([[-1e4, -1e4, -200], [1e4, -1e4, -200], [0, 2e4, -200.0]])
    ends = slice_mm(wall, rig, grid, 16)
    assert ends is not None
    k = DISTANCE_MM / (DISTANCE_MM + 200.0)
    seen = k * np.sort(ends[:, 0])[:, None] + (1 - k) * rig.eye_x_mm
    reach = 128.0 + 2.0 * grid.column_mm
    # The left end is where the eye that sees farthest left has it on its frustum's side.
    np.testing.assert_allclose((seen[0].max(), seen[1].min()), (-reach, reach))


# ---- points and pixels ------------------------------------------------------------------------


def lattice(
    rng: np.random.Generator,
) -> tuple[Triangles, Rig, ViewGrid, list[PointRow]]:
    rig, grid = views()
    picture = Image("picture", np.full((16, 16, 4), 255, np.uint8))
    material = Material("m", double_sided=True, base_color_texture=TextureSlot(0))
    corners = soup(rng)
    texcoords = rng.uniform(0, 1, (len(corners), 3, 2))
    scene = scene_of(
        mesh_of(corners, texcoords=texcoords), materials=(material,), images=(picture,)
    )
    triangles = placed(scene, np.eye(4))
    return triangles, rig, grid, point_rows(scene, triangles, rig, grid)


def mismatches(
    triangles: Triangles, rig: Rig, grid: ViewGrid, rows: list[PointRow]
) -> tuple[int, int]:
    """Pixels that a triangle covers and its points do not fill once, and filled ones beside it."""
    filled = np.zeros((len(triangles), grid.rows, rig.views, grid.columns), int)
    for row in rows:
        for view in range(rig.views):
            for begin, end in footprints(row, rig, grid, view):
                filled[row.triangle, row.row, view, begin:end] += 1
    through = rays(rig, grid, Pixels(*np.ogrid[: grid.rows, : rig.views, : grid.columns]))
    wrong = beside = 0
    for index in range(len(triangles)):
        meeting = meet(triangles.p_display[index], through, DISTANCE_MM)
        covered = covers(meeting, triangles, index, rig.near_mm)
        wrong += np.count_nonzero(filled[index][covered] != 1)
        beside += np.count_nonzero(filled[index][~covered])
    return wrong, beside


def test_each_pixel_of_a_triangle_belongs_to_one_point(rng: np.random.Generator) -> None:
    triangles, rig, grid, rows = lattice(rng)
    assert mismatches(triangles, rig, grid, rows) == (0, 0)
    counts = np.array([row.count for row in rows])
    assert len(rows) > 300
    assert (counts > 1).sum() > 50
    assert all(len(footprints(row, rig, grid, 1)) == row.count for row in rows)


def test_a_lattice_a_fiftieth_of_a_column_aside_is_caught(rng: np.random.Generator) -> None:
    triangles, rig, grid, rows = lattice(rng)
    right = np.array([0.08, 0.0, 0.0])
    aside = [dataclasses.replace(row, ends_mm=row.ends_mm + right) for row in rows]
    wrong, beside = mismatches(triangles, rig, grid, aside)
    assert wrong > 0
    assert beside > 0
    assert mismatches(triangles, rig, grid, rows[::2])[0] > 0
    assert mismatches(triangles, rig, grid, rows + rows)[0] > 0


def test_cells_are_counted_from_end_to_end(rng: np.random.Generator) -> None:
    *_, rows = lattice(rng)
    for row in rows:
        assert row.first * row.cell <= row.columns[0] < (row.first + 1) * row.cell
        last = row.first + row.count
        assert row.columns[1] <= last * row.cell
        assert row.count == 1 or row.columns[1] > (last - 1) * row.cell


# ---- density ----------------------------------------------------------------------------------


def test_the_densest_view_covers_most_pixels(rng: np.random.Generator) -> None:
    rig, _ = views(eyes=(-100.0, -40.0, 0.0, 70.0, 90.0))
    for corners in soup(rng):
        sides = np.abs(eye_sides(corners, rig))
        assert sides[densest_view(corners, rig)] == sides.max()


def test_no_pixel_covers_less_than_the_densest(rng: np.random.Generator) -> None:
    """Against areas of pixels projected back on the triangle's plane, by the rays' derivatives."""
    rig, grid = views()
    row_mm = grid.panel_mm[1] / grid.rows
    tightest = np.inf
    for corners in soup(rng):
        bound = densest_pixel_mm2(corners, rig, grid)
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        for view, eye_x in enumerate(rig.eye_x_mm):
            eye = np.array([eye_x, 0.0, DISTANCE_MM])
            for corner in corners[DISTANCE_MM - corners[:, 2] >= rig.near_mm]:
                k = DISTANCE_MM / (DISTANCE_MM - corner[2])
                window = eye + k * (corner - eye)
                # Moves of the hit for a column and a row: the ray's, brought back to the plane.
                hits = []
                for step in ([grid.column_mm, 0, 0], [0, row_mm, 0]):
                    towards = window - eye
                    slope = normal @ np.array(step) / (normal @ towards)
                    hits.append((np.array(step) - slope * towards) / k)
                area = np.linalg.norm(np.cross(*hits))
                assert area >= bound * (1 - 1e-9), view
                tightest = min(tightest, area / bound)
    assert tightest < 1 + 1e-9  # the bound is reached


@pytest.mark.parametrize(
    ("repeats", "length"), [(1.0, 4.0), (2.0, 2.0), (0.1, MOST_COLUMNS), (16.0, 1.0)]
)
def test_points_are_as_long_as_texels(repeats: float, length: float) -> None:
    """A picture of 16 × 8 texels over the whole window of 64 × 32 pixels."""
    rig, grid = views(eyes=(0.0,))
    picture = Image("picture", np.zeros((8, 16, 4), np.uint8))
    material = Material("m", base_color_texture=TextureSlot(0), normal_texture=TextureSlot(0))
    corners = square(256.0, 0.0) * [1, 0.5, 1]
    texcoords = repeats * (corners[..., :2] / (256, 128) + 0.5)
    scene = scene_of(
        mesh_of(corners, texcoords=texcoords), materials=(material,), images=(picture,)
    )
    rows = point_rows(scene, placed(scene, np.eye(4)), rig, grid)
    np.testing.assert_allclose([row.cell for row in rows], length)


def test_a_transform_of_texture_coordinates_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    rig, grid = views(eyes=(0.0,))
    picture = Image("picture", np.zeros((8, 16, 4), np.uint8))
    slot = TextureSlot(0, uv_transform=np.diag([2.0, 2.0, 1.0]))
    corners = square(256.0, 0.0) * [1, 0.5, 1]
    scene = scene_of(
        mesh_of(corners, texcoords=corners[..., :2] / (256, 128)),
        materials=(Material("m", base_color_texture=slot),),
        images=(picture,),
    )
    triangles = placed(scene, np.eye(4))
    np.testing.assert_allclose(points.point_columns(scene, triangles, 0, rig, grid), 2.0)


# ---- stochastic culling -----------------------------------------------------------------------


def test_tiny_triangles_are_kept_by_their_area() -> None:
    area = np.repeat([0.02, 0.05, 0.09, 0.1, 5.0], 20000)
    share = kept(area, 3).reshape(5, -1).mean(axis=1)
    # 20,000 draws: a standard deviation of 0.35 %.
    np.testing.assert_allclose(share, [0.2, 0.5, 0.9, 1.0, 1.0], atol=0.015)
    assert np.mean(kept(area, 3) != kept(area, 4)) > 0.1


def test_hashes_are_spread_evenly() -> None:
    ids = np.arange(1 << 16)
    drawn = hash_unit(ids, np.full_like(ids, 12345), np.zeros_like(ids))
    counts, _ = np.histogram(drawn, 64, (0.0, 1.0))
    # A bin holds 1024 ± 32; five deviations.
    assert np.abs(counts - 1024).max() < 160
    assert abs(np.corrcoef(drawn[:-1], drawn[1:])[0, 1]) < 0.02


def test_areas_are_counted_in_pixels_of_the_densest_view() -> None:
    rig, grid = views(eyes=(0.0,))
    # Half of 32 mm squared in pixels of 4 × 4 mm, at the panel and at twice the size before it.
    np.testing.assert_allclose(areas_px(triangles_of(square(32.0, 0.0)), rig, grid), 32.0)
    np.testing.assert_allclose(areas_px(triangles_of(square(32.0, 256.0)), rig, grid), 128.0)

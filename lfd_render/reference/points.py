"""The row lattice: which points a triangle is sampled by, and which pixels each of them fills.

All eyes stand at the height of the window's middle, so the plane through them and the centre line
of a window row is the same for every view, and cuts a triangle in one segment, its slice. Points
lie along slices: cells of one length, in columns of the eye that sees the triangle's plane densest.
The length follows from the texture-based limit, equations 1–3 of Gavane and Watson 2024 (section
3.1), applied along the row only, because rows are shared by all views.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import Rig, ViewGrid
from lfd_render.reference.raster import faces
from lfd_render.reference.transform import Triangles
from lfd_render.scene import Material, Scene

Float64 = NDArray[np.float64]

MOST_COLUMNS = 16.0  # longest point, where no texture limits it
MARGIN_COLUMNS = 2.0  # how far outside the window slices reach, for columns that stick out of it


@dataclass(frozen=True, eq=False)
class PointRow:
    """The points of one triangle on one window row: cells first … first + count − 1.

    ends_mm: [2, 3], the slice in display space, from left to right as the densest eye sees it;
    densest: that eye's view; columns: [2], where it sees the ends, rows' offsets included;
    cell: length of a point in its columns.
    """

    triangle: int
    row: int
    ends_mm: Float64
    densest: int
    columns: Float64
    cell: float
    first: int
    count: int


def point_rows(scene: Scene, triangles: Triangles, rig: Rig, grid: ViewGrid) -> list[PointRow]:
    """All points of a scene, by triangle and row."""
    found = []
    for index in range(len(triangles)):
        corners = triangles.p_display[index]
        sides = eye_sides(corners, rig)
        if not faces(-sides, triangles.mirrored[index], triangles.double_sided[index]).any():
            continue
        densest = densest_view(corners, rig)
        cell = point_columns(scene, triangles, index, rig, grid)
        for row in range(grid.rows):
            ends_mm = slice_mm(corners, rig, grid, row)
            if ends_mm is None:
                continue
            columns = columns_of(ends_mm, rig, grid, row, densest)
            order = np.argsort(columns, kind="stable")
            ends_mm, columns = ends_mm[order], columns[order]
            first, count = cells_of(columns, cell)
            found.append(PointRow(index, row, ends_mm, densest, columns, cell, first, count))
    return found


def cells_of(columns: Float64, cell: float) -> tuple[int, int]:
    """First index and number of the half-open cells that an interval [2] of columns touches."""
    first = int(np.floor(columns[0] / cell))
    return first, max(1, int(np.ceil(columns[1] / cell)) - first)


def columns_of(p_display: Float64, rig: Rig, grid: ViewGrid, row: int, view: int) -> Float64:
    """Columns at which points [n, 3] on a row's plane appear in a view: x = k·X + (1 − k)·s."""
    k = rig.distance_mm / (rig.distance_mm - p_display[:, 2])
    x_mm = k * p_display[:, 0] + (1.0 - k) * rig.eye_x_mm[view]
    columns: Float64 = x_mm / grid.column_mm + grid.row_offset[row]
    return columns


def slice_mm(corners: Float64, rig: Rig, grid: ViewGrid, row: int) -> Float64 | None:
    """The segment [2, 3] in which a row's plane cuts a triangle, or None.

    A corner on the plane counts as above it, which makes upper edges part of the triangle and lower
    ones not. Of the segment the part counts that lies behind the near plane and between the first
    and the last place that any eye sees in its frustum, MARGIN_COLUMNS wider than the window.
    """
    y_mm = grid.row_mm()[row]
    above = rig.distance_mm * corners[:, 1] - y_mm * (rig.distance_mm - corners[:, 2])
    crossings = []
    for i, j in ((0, 1), (1, 2), (2, 0)):
        if (above[i] >= 0.0) != (above[j] >= 0.0):
            t = above[i] / (above[i] - above[j])
            crossings.append(corners[i] + t * (corners[j] - corners[i]))
    if not crossings:
        return None
    p, q = crossings
    part = _between(
        rig.distance_mm - rig.near_mm - np.array([p[2]]),
        rig.distance_mm - rig.near_mm - np.array([q[2]]),
    )
    margin = max(MARGIN_COLUMNS, grid.columns - grid.panel_mm[0] / grid.column_mm)
    reach_mm = 0.5 * grid.panel_mm[0] + margin * grid.column_mm
    for sign in (1.0, -1.0):  # right of the left side, left of the right side
        at_p, at_q = (_inner(end, sign, reach_mm, rig) for end in (p, q))
        seen = _between(at_p, at_q)
        part = (max(part[0], seen[0]), min(part[1], seen[1]))
    if part[0] >= part[1]:
        return None
    return np.stack([p + part[0] * (q - p), p + part[1] * (q - p)])


def _inner(point: Float64, sign: float, reach_mm: float, rig: Rig) -> Float64:
    """For each eye: how far inside of one side of its frustum a point is, times its depth."""
    depth = rig.distance_mm - point[2]
    x_times_depth = rig.distance_mm * point[0] - point[2] * rig.eye_x_mm
    inner: Float64 = reach_mm * depth + sign * x_times_depth
    return inner


def _between(at_p: Float64, at_q: Float64) -> tuple[float, float]:
    """First and last parameter of a segment where any of some linear functions is ≥ 0."""
    first, last = np.inf, -np.inf
    for p, q in zip(at_p, at_q, strict=True):
        if p >= 0.0 or q >= 0.0:
            first = min(first, 0.0 if p >= 0.0 else float(p / (p - q)))
            last = max(last, 1.0 if q >= 0.0 else float(p / (p - q)))
    return first, last


def eye_sides(corners: Float64, rig: Rig) -> Float64:
    """normal·(E − A) of each eye, mm³ [view]: positive where corners run counter-clockwise."""
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    eyes = np.zeros((rig.views, 3))
    eyes[:, 0], eyes[:, 2] = rig.eye_x_mm, rig.distance_mm
    sides: Float64 = (eyes - corners[0]) @ normal
    return sides


def densest_view(corners: Float64, rig: Rig) -> int:
    """The view in which the triangle's plane covers most pixels: that of the greatest |side|.

    Of two alike the last, as their points are alike too.
    """
    sides = np.abs(eye_sides(corners, rig))
    return 0 if sides[0] > sides[-1] else rig.views - 1


def densest_pixel_mm2(corners: Float64, rig: Rig, grid: ViewGrid) -> float:
    """Equation 3's size_xy: the least area on the triangle that a pixel of any view can cover.

    At the depth d a pixel of the window is d/D as wide and as high, and d·|n|/side times as large
    on a plane turned away; least at the triangle's nearest depth for the eye of the greatest side.
    """
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    side = np.abs(eye_sides(corners, rig)).max()
    depth = max(rig.near_mm, rig.distance_mm - corners[:, 2].max())
    facing_mm2 = grid.column_mm * grid.panel_mm[1] / grid.rows * (depth / rig.distance_mm) ** 2
    return float(facing_mm2 * depth * np.linalg.norm(normal) / side)


def point_columns(
    scene: Scene,
    triangles: Triangles,
    index: int,
    rig: Rig,
    grid: ViewGrid,
    *,
    isotropic: bool = False,
    texture_limit: bool = True,
) -> float:
    """Length of a triangle's points in columns: 1 to MOST_COLUMNS; isotropic: where a row is
    shorter than a column on the triangle, from as little as 1/MOST_COLUMNS on."""
    corners = triangles.p_display[index]
    columns = _square_columns(corners, rig, grid) if isotropic else 1.0
    if not texture_limit:
        return columns
    material = scene.materials[int(triangles.material[index])]
    texels = most_texels(scene, material, triangles.texcoords[index])
    if texels == 0.0:
        return MOST_COLUMNS
    area_mm2 = 0.5 * np.linalg.norm(np.cross(corners[1] - corners[0], corners[2] - corners[0]))
    size_uv = area_mm2 / texels  # equation 2
    size_xy = densest_pixel_mm2(corners, rig, grid) * columns
    return float(columns * np.clip(np.sqrt(size_uv / size_xy), 1.0, MOST_COLUMNS / columns))


def _square_columns(corners: Float64, rig: Rig, grid: ViewGrid) -> float:
    """How many columns are as long as a row, both projected back to the triangle's middle from the
    densest eye; at most 1."""
    view = densest_view(corners, rig)
    sides = pixel_sides_mm(corners, corners.mean(axis=0), rig, grid, view)
    return float(np.clip(sides[1] / sides[0], 1.0 / MOST_COLUMNS, 1.0))


def pixel_sides_mm(corners: Float64, p: Float64, rig: Rig, grid: ViewGrid, view: int) -> Float64:
    """A view's column and row, [2] mm, projected back to a point p [3] of a triangle's plane: the
    ray moves on by a step, and along itself as far as keeps it on the plane."""
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    ray = p - (rig.eye_x_mm[view], 0.0, rig.distance_mm)
    steps = np.array([[grid.column_mm, 0.0, 0.0], [0.0, grid.panel_mm[1] / grid.rows, 0.0]])
    depth = max(rig.distance_mm - p[2], rig.near_mm)
    moved = steps - np.outer(steps @ normal / (ray @ normal), ray)
    return np.asarray(depth / rig.distance_mm * np.linalg.norm(moved, axis=1))


def row_point_mm(
    scene: Scene,
    triangles: Triangles,
    index: int,
    rig: Rig,
    grid: ViewGrid,
    *,
    row: int,
    p: Float64,
    isotropic: bool = False,
) -> Float64:
    """Where the point of a row that owns p [3], on the row's slice, is shaded: at its centre, kept
    within the slice."""
    corners = triangles.p_display[index]
    ends_mm = slice_mm(corners, rig, grid, row)
    assert ends_mm is not None
    densest = densest_view(corners, rig)
    cell = point_columns(scene, triangles, index, rig, grid, isotropic=isotropic)
    seen = columns_of(np.vstack([ends_mm, p]), rig, grid, row, densest)
    centre = (np.floor(seen[2] / cell) + 0.5) * cell
    part = (np.clip(centre, *np.sort(seen[:2])) - seen[0]) / (seen[1] - seen[0])
    over_depth = (np.array([1.0 - part, part]) / (rig.distance_mm - ends_mm[:, 2]))[:, None]
    return np.asarray((over_depth * ends_mm).sum(axis=0) / over_depth.sum())


def most_texels(scene: Scene, material: Material, texcoords: Float64) -> float:
    """Equation 1: n_tex, the most texels that any of a material's textures lays on a triangle.

    texcoords: [corner, set, uv].
    """
    most = 0.0
    for slot in material.texture_slots().values():
        height, width = scene.images[slot.image].pixels.shape[:2]
        uv = texcoords[:, slot.texcoord]
        if slot.uv_transform is not None:
            uv = uv @ slot.uv_transform[:2, :2].T
        (u1, v1), (u2, v2) = uv[1] - uv[0], uv[2] - uv[0]
        most = max(most, 0.5 * abs(u1 * v2 - u2 * v1) * width * height)
    return most


def footprints(points: PointRow, rig: Rig, grid: ViewGrid, view: int) -> list[tuple[int, int]]:
    """Columns [begin, end) of a view's row that each point fills: their centres lie in its cell.

    A cell's boundary stands still on the surface, so other views see it where the shear puts it.
    """
    from_column, to_column = points.columns
    cells = points.first + np.arange(1, points.count)
    boundaries = np.concatenate([[from_column], cells * points.cell, [to_column]])
    # Where boundaries lie on the slice: window position is linear in the point over its depth.
    part = (boundaries - from_column) / max(to_column - from_column, np.finfo(np.float64).tiny)
    depths = rig.distance_mm - points.ends_mm[:, 2]
    near_weight, far_weight = (1.0 - part) / depths[0], part / depths[1]
    weight = (far_weight / (near_weight + far_weight))[:, None]
    p_display = (1.0 - weight) * points.ends_mm[0] + weight * points.ends_mm[1]
    seen = columns_of(p_display, rig, grid, points.row, view)
    cuts = np.clip(np.ceil(seen - 0.5), 0, grid.columns).astype(int)
    if cuts[0] > cuts[-1]:  # an eye on the other side sees the slice turned round
        cuts = cuts[::-1]
    return list(zip(cuts[:-1].tolist(), cuts[1:].tolist(), strict=True))

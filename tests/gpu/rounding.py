"""How far float32 may be off, and whether a picture differs from the reference by no more.

The bounds are first-order: each operation rounds its result by at most 2⁻²⁴ of it (ε), and terms
that cancel leave their own rounding behind. How many roundings add up is measured. A pixel may show
another triangle than the reference only where its centre lies within such a bound of an edge, or
two depths within theirs of each other; everywhere else ids are held to be equal.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import Rig, ViewGrid
from lfd_render.reference import NO_TRIANGLE, Pixels, Triangles, Visibility
from lfd_render.reference.raster import Meeting, boundary_distance, covers, meet, rays
from lfd_render.reference.shade import Shading, cutoff_of, points_at

EPSILON = 2.0**-24
# Over 500 random scenes no edge was off by more than 0.1 of the sum of its terms' ε, since seldom
# all of them are at their largest; no depth by more than 2.7, slices ending far outside the view.
EDGE_ROUNDINGS = 0.5
DEPTH_ROUNDINGS = 6.0
GENERAL_DEPTH_ROUNDINGS = 10.0  # 4.1 measured over 1,000 scenes
ALPHA_TOLERANCE = 0.005  # of filtered 8-bit alpha: the device's texture weights have 8 bits


def edge_band_px(
    corners: NDArray[np.float64], k: NDArray[np.float64], rig: Rig, grid: ViewGrid
) -> NDArray[np.float64]:
    """How far, in pixels, the device may move an edge of a triangle where k = D/d.

    A coordinate as large as the triangle's largest, or as D where depths are taken, is off by ε of
    it; the shear carries that to the window k times as large, and by the eye's angle sideways. What
    is stored, a column and its change with the eye, is off by ε of itself.
    """
    magnitude = max(rig.distance_mm, float(np.abs(corners).max()))
    return EDGE_ROUNDINGS * EPSILON * _edge_terms(magnitude, k, rig, grid)


def _edge_terms(
    magnitude: NDArray[np.float64] | float, k: NDArray[np.float64], rig: Rig, grid: ViewGrid
) -> NDArray[np.float64]:
    row_mm = grid.panel_mm[1] / grid.rows
    eye_mm = np.abs(rig.eye_x_mm).max()
    sideways = 1.0 + (0.5 * max(grid.panel_mm) + eye_mm) / rig.distance_mm
    moved = k * magnitude * sideways / min(grid.column_mm, row_mm)
    stored = grid.columns + grid.rows + np.abs(1.0 - k) * eye_mm / grid.column_mm
    return moved + stored


def depth_band_mm(
    triangles: Triangles,
    ids: NDArray[np.int64],
    rig: Rig,
    grid: ViewGrid,
    pixels: Pixels,
    *,
    general: bool = False,
) -> NDArray[np.float64]:
    """How far the device's depths of triangles at pixels may be off, [pixel]."""
    corners = triangles.p_display[ids]
    meeting = meet(corners, rays(rig, grid, pixels), rig.distance_mm)
    if general:
        return (
            GENERAL_DEPTH_ROUNDINGS * EPSILON * _weights_terms(corners, meeting, rig, grid, pixels)
        )
    depths = rig.distance_mm - corners[:, :, 2]
    nearest, farthest = np.maximum(depths.min(axis=1), rig.near_mm), depths.max(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        # k = D/d is the sum of volumes over V (see reference.raster), linear in the window point.
        k_per_column = grid.column_mm * meeting.normals[..., 0].sum(axis=-1) / meeting.whole
    k = rig.distance_mm / nearest
    magnitude = np.maximum(rig.distance_mm, np.abs(corners).max(axis=(1, 2)))
    # The slice's ends: their own k, off as their depths are, and their columns, off as edges are.
    own = k * k * magnitude / rig.distance_mm + k
    moved = np.abs(np.nan_to_num(k_per_column, nan=np.inf)) * _edge_terms(magnitude, k, rig, grid)
    at = np.clip(np.nan_to_num(meeting.depths, nan=np.inf), nearest, farthest)
    band = DEPTH_ROUNDINGS * EPSILON * (at * at / rig.distance_mm * (own + moved) + at)
    # The device keeps depths within the slice's own.
    return np.minimum(band, farthest - nearest + DEPTH_ROUNDINGS * EPSILON * farthest * own)


def _weights_terms(
    corners: NDArray[np.float64], meeting: Meeting, rig: Rig, grid: ViewGrid, pixels: Pixels
) -> NDArray[np.float64]:
    """Sum of the terms, [pixel] mm, whose rounding moves a depth that is taken by weights.

    With corners as (column·d, row·d, d) less the centre times d, weights are 2 × 2 determinants of
    two of them. Their factors are as far off as the terms that cancel in them are large; a wrong
    weight moves the depth by its corner's distance in depth.
    """
    through = rays(rig, grid, pixels)
    d = rig.distance_mm - corners[:, :, 2]
    row_mm = grid.panel_mm[1] / grid.rows
    centre = np.stack(
        [through.x_mm / grid.column_mm + 0.5 * grid.columns, pixels.row + 0.5], axis=-1
    )[:, None]
    sideways = corners[:, :, 2] * through.eye_mm[:, None]
    x = (rig.distance_mm * corners[:, :, 0] - sideways) / grid.column_mm
    y = -rig.distance_mm * corners[:, :, 1] / row_mm
    place = np.stack([x, y], axis=-1) + 0.5 * d[..., None] * (grid.columns, grid.rows)
    size = np.abs(np.stack([x, y], axis=-1)) + np.abs(d[..., None]) * (grid.columns, grid.rows)
    size[..., 0] += np.abs(sideways) / grid.column_mm
    at = np.abs(place - centre * d[..., None])
    p, q, p_off, q_off = (np.roll(a, -n, axis=1) for a in (at, size) for n in (1, 2))
    wrong = np.sum(p_off * q[..., ::-1] + p * q_off[..., ::-1] + p * q[..., ::-1], axis=-1)
    weights = _determinants(place - centre * d[..., None])
    with np.errstate(divide="ignore", invalid="ignore"):
        moved = np.sum(wrong * np.abs(d - meeting.depths[:, None]), axis=-1)
        terms = moved / np.abs(weights.sum(axis=-1)) + np.abs(meeting.depths)
    return np.nan_to_num(terms, nan=np.inf)


def _determinants(at: NDArray[np.float64]) -> NDArray[np.float64]:
    p, q = np.roll(at, -1, axis=1), np.roll(at, -2, axis=1)
    return p[..., 0] * q[..., 1] - p[..., 1] * q[..., 0]


@dataclass(frozen=True, eq=False)
class Explained:
    """Pixels that differ from the reference, and which of them rounding does not explain."""

    flips: Pixels
    unexplained: NDArray[np.bool_]  # [flip]


def explain(
    found: NDArray[np.uint32],
    expected: Visibility,
    triangles: Triangles,
    rig: Rig,
    grid: ViewGrid,
    shading: Shading,
    *,
    limit_mm: NDArray[np.float64] | None = None,
    blended: bool = False,
    general: bool = False,
    snap_px: float = 0.0,
) -> Explained:
    """Judge each pixel that shows another triangle than expected.

    A triangle certainly covers a pixel when it does so by more than its band; it possibly does when
    it covers it or misses by less. What is found is explained when it possibly covers the pixel and
    is, depth band and all, no farther than all that certainly does. shading: for cutoffs, since
    alpha may be off by ALPHA_TOLERANCE; limit_mm: depths [row, view, column] that hide what is
    behind them, for blended triangles; snap_px: how far hardware moves corners to a raster of its
    own, which moves edges by as much and depths by the plane's slope.
    """
    flips = Pixels(*np.nonzero(found != expected.ids))
    shown = found[flips.row, flips.view, flips.column]
    count = len(shown)
    certain_mm = np.full(count, np.inf)
    certainly_something = np.zeros(count, bool)
    possible = shown == NO_TRIANGLE
    nearest_mm = np.full(count, -np.inf)
    if limit_mm is not None:
        certain_mm = limit_mm[flips.row, flips.view, flips.column].astype(np.float64)
        limit = certain_mm.copy()
    for index in np.flatnonzero(triangles.blended == blended).tolist() if count else ():
        certainly, possibly, depths, band_mm = _coverage(
            triangles, index, rig, grid, flips, shading, general, snap_px
        )
        is_shown = shown == index
        possible |= is_shown & possibly
        nearest_mm[is_shown] = (depths - band_mm)[is_shown]
        certain_mm = np.where(certainly, np.minimum(certain_mm, depths + band_mm), certain_mm)
        hidden = False if limit_mm is None else depths + band_mm > limit
        certainly_something |= certainly & ~np.asarray(hidden)
    empty = shown == NO_TRIANGLE
    explained = np.where(empty, ~certainly_something, possible & (nearest_mm <= certain_mm))
    return Explained(flips, ~explained)


def _coverage(
    triangles: Triangles,
    index: int,
    rig: Rig,
    grid: ViewGrid,
    pixels: Pixels,
    shading: Shading,
    general: bool,
    snap_px: float,
) -> tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.float64], NDArray[np.float64]]:
    """Whether a triangle certainly and possibly covers pixels, its depths there and their bands."""
    corners = triangles.p_display[index]
    ids = np.full(len(pixels.row), index)
    meeting = meet(corners, rays(rig, grid, pixels), rig.distance_mm)
    inside = covers(meeting, triangles, index, rig.near_mm)
    distance_px, k = boundary_distance(corners, rig, grid, pixels)
    if distance_px.shape[1]:
        doubtful = (distance_px <= edge_band_px(corners, k, rig, grid) + snap_px).any(axis=1)
    else:
        doubtful = np.zeros(len(ids), bool)
    lowest = max(rig.near_mm, float(rig.distance_mm - corners[:, 2].max()))
    highest = float(rig.distance_mm - corners[:, 2].min())
    depths = np.nan_to_num(meeting.depths, nan=lowest)
    depths = np.clip(depths, min(lowest, highest), highest)
    band_mm = depth_band_mm(triangles, ids, rig, grid, pixels, general=general)
    if snap_px:
        band_mm = band_mm + snap_px * _depth_per_pixel(meeting, depths, grid)
    certainly, possibly = inside & ~doubtful, inside | doubtful
    cutoff = cutoff_of(shading.scene.materials[int(triangles.material[index])])
    if cutoff > 0.0:
        with np.errstate(all="ignore"):
            alpha = shading.coverage(points_at(triangles, rig, grid, ids, pixels))
        certainly &= alpha >= cutoff + ALPHA_TOLERANCE
        possibly &= alpha >= cutoff - ALPHA_TOLERANCE
    return certainly, possibly, depths, band_mm


def _depth_per_pixel(
    meeting: Meeting, depths: NDArray[np.float64], grid: ViewGrid
) -> NDArray[np.float64]:
    """How fast depths change over a column and a row together, [pixel] mm."""
    steps_mm = (grid.column_mm, grid.panel_mm[1] / grid.rows)
    with np.errstate(divide="ignore", invalid="ignore"):
        slopes = [
            np.abs(step * meeting.normals[..., axis].sum(axis=-1) / meeting.whole)
            for axis, step in enumerate(steps_mm)
        ]
    # k = D/d is linear in the window point.
    return np.nan_to_num(sum(slopes) * depths**2 / meeting.distance_mm, nan=np.inf)

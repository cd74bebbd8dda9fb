"""Visibility by its definition: the nearest triangle along the ray of each view pixel.

The ray of a pixel starts at its view's eye E = (s, 0, D) and goes through the pixel's centre W on
the window. With corners A, B, C seen from the eye (A' = A − E, …), the direction W − E is a sum
α·A' + β·B' + γ·C', where by Cramer's rule

    α = (W − E)·(B' × C') / V,   β and γ in turn,   V = A'·(B' × C') = −normal·(E − A)

The ray meets the triangle in front of the eye exactly when all three are ≥ 0, at the fraction
t = 1/(α + β + γ) of the way to the window, so at the depth d = D·t. No clipping is needed: a corner
behind the eye is a vector like any other.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import Rig, ViewGrid
from lfd_render.reference.transform import Triangles

Float64 = NDArray[np.float64]
Int = NDArray[np.int64]
Bool = NDArray[np.bool_]
NO_TRIANGLE = 0xFFFFFFFF  # id of a pixel that shows the background


@dataclass(frozen=True, eq=False)
class Pixels:
    """View pixels, by arrays that broadcast together. Row 0 is the top one, view 0 the leftmost."""

    row: Int
    view: Int
    column: Int

    def __getitem__(self, chosen: Bool | Int) -> Pixels:
        return Pixels(self.row[chosen], self.view[chosen], self.column[chosen])


# Whether a triangle is opaque at pixels.
Accepts = Callable[[int, Pixels], Bool]


@dataclass(frozen=True, eq=False)
class Visibility:
    """What each view pixel shows, [row, view, column].

    ids: uint32, NO_TRIANGLE for the background; depths: float64, D − Z in mm, ∞ there.
    """

    ids: NDArray[np.uint32]
    depths: Float64

    def shown(self) -> tuple[Pixels, Int]:
        """The pixels [n] that show a triangle, and which."""
        at = np.nonzero(self.ids != NO_TRIANGLE)
        return Pixels(*at), self.ids[at].astype(np.int64)


@dataclass(frozen=True, eq=False)
class Rays:
    """Rays of pixels: eye and window point in mm, arrays that broadcast together."""

    eye_mm: Float64
    x_mm: Float64
    y_mm: Float64


def rays(rig: Rig, grid: ViewGrid, pixels: Pixels) -> Rays:
    """Rays through the centres of pixels."""
    x_mm = (pixels.column + 0.5 - grid.row_offset[pixels.row]) * grid.column_mm
    y_mm = grid.panel_mm[1] * (0.5 - (pixels.row + 0.5) / grid.rows)
    return Rays(rig.eye_x_mm[pixels.view], x_mm, np.asarray(y_mm))


@dataclass(frozen=True, eq=False)
class Meeting:
    """Rays against triangles, one triangle for all rays or one for each.

    volumes: [..., corner], (W − E)·(B' × C') and its turns, linear in the window point;
    normals: [..., corner, xyz], their gradients; whole: [...], V.
    """

    volumes: Float64
    normals: Float64
    whole: Float64
    distance_mm: float

    @property
    def depths(self) -> Float64:
        """Depth where the ray meets the triangle's plane; ±∞ or NaN where it does not."""
        with np.errstate(divide="ignore", invalid="ignore"):
            depths: Float64 = self.distance_mm * self.whole / self.volumes.sum(axis=-1)
        return depths

    @property
    def weights(self) -> Float64:
        """Barycentric weights of the corners there, [..., corner]."""
        weights: Float64 = self.volumes / self.volumes.sum(axis=-1, keepdims=True)
        return weights


def meet(corners: Float64, through: Rays, distance_mm: float) -> Meeting:
    """Rays against triangles; corners: [3, 3] for all rays, or [..., 3, 3] for each."""
    zeros = np.zeros_like(through.eye_mm)
    eye = np.stack([through.eye_mm, zeros, zeros + distance_mm], axis=-1)
    from_eye = corners - eye[..., None, :]
    normals = np.cross(np.roll(from_eye, -1, axis=-2), np.roll(from_eye, -2, axis=-2))
    x, y, z = (through.x_mm - through.eye_mm)[..., None], through.y_mm[..., None], -distance_mm
    volumes = x * normals[..., 0] + y * normals[..., 1] + z * normals[..., 2]
    whole = np.sum(from_eye[..., 0, :] * normals[..., 0, :], axis=-1)
    return Meeting(volumes, normals, whole, distance_mm)


def inside(meeting: Meeting) -> Bool:
    """Whether rays pass through their triangle, in front of the eye.

    Half-open, so that a pixel on an edge of two triangles belongs to one: a centre on an edge is
    inside when a step to the right, or along a level edge a step downward, leads inside. So left
    and upper edges are in, right and lower edges out.
    """
    sign = np.sign(meeting.whole)[..., None]
    volumes = meeting.volumes * sign
    rightward = meeting.normals[..., 0] * sign
    downward = -meeting.normals[..., 1] * sign
    leads_in = (rightward > 0.0) | ((rightward == 0.0) & (downward > 0.0))
    within: Bool = np.all((volumes > 0.0) | ((volumes == 0.0) & leads_in), axis=-1)
    return within


def faces(whole: Float64, mirrored: Bool | bool, double_sided: Bool | bool) -> Bool:
    """Whether eyes see a side that is drawn: normal·(E − A) > 0, which a mirror turns round."""
    side = -whole
    front = np.where(mirrored, side < 0.0, side > 0.0)
    return np.asarray(np.where(double_sided, side != 0.0, front), bool)


def visible(
    triangles: Triangles,
    rig: Rig,
    grid: ViewGrid,
    accepts: Accepts | None = None,
    *,
    over: Visibility | None = None,
) -> Visibility:
    """The nearest triangle of every view pixel; of those at one depth the one of smallest id.

    accepts: which pixels a triangle is opaque at, everywhere by default. Without `over` the solid
    triangles; with it the blended ones that lie no farther than it. Triangles and their parts
    closer to the eyes than rig.near_mm are not seen.
    """
    ids = np.full((grid.rows, rig.views, grid.columns), NO_TRIANGLE, np.uint32)
    # An equal depth keeps the smaller id, but a blended triangle lies over a solid one.
    depths = np.full(ids.shape, np.inf) if over is None else np.nextafter(over.depths, np.inf)
    for index in np.flatnonzero(triangles.blended == (over is not None)).tolist():
        box = reach(triangles.p_display[index], rig, grid)
        pixels = Pixels(*np.ogrid[box])
        meeting = meet(triangles.p_display[index], rays(rig, grid, pixels), rig.distance_mm)
        found = covers(meeting, triangles, index, rig.near_mm)
        found &= meeting.depths < depths[box]
        if accepts is not None and found.any():
            at = np.nonzero(found)
            row, view, column = (a + axis.start for a, axis in zip(at, box, strict=True))
            found[at] = accepts(index, Pixels(row, view, column))
        ids[box][found] = index
        depths[box][found] = meeting.depths[found]
    return Visibility(ids, np.where(ids == NO_TRIANGLE, np.inf, depths))


def reach(corners: Float64, rig: Rig, grid: ViewGrid) -> tuple[slice, slice, slice]:
    """A box of pixels (rows, views, columns) outside which a triangle [3, 3] is seen in no view.

    It only saves time: the picture of what lies behind the near plane, with a pixel to spare.
    """
    polygon = near_part(corners, rig.distance_mm - rig.near_mm)
    if not len(polygon):
        return slice(0, 0), slice(0, rig.views), slice(0, 0)
    k = (rig.distance_mm / (rig.distance_mm - polygon[:, 2]))[:, None]
    x_mm = k * polygon[:, :1] + (1.0 - k) * rig.eye_x_mm
    across = x_mm[..., None] / grid.column_mm + grid.row_offset
    down = (0.5 - k * polygon[:, 1:2] / grid.panel_mm[1]) * grid.rows
    rows, columns = (
        slice(*np.clip((np.floor(at.min()) - 1, np.ceil(at.max()) + 1), 0, most).astype(int))
        for at, most in ((down, grid.rows), (across, grid.columns))
    )
    return rows, slice(0, rig.views), columns


def covers(meeting: Meeting, triangles: Triangles, index: int | Int, near_mm: float) -> Bool:
    """Which rays see a triangle if nothing stands before it; index: one, or one for each ray."""
    drawn = faces(meeting.whole, triangles.mirrored[index], triangles.double_sided[index])
    with np.errstate(invalid="ignore"):
        covered: Bool = drawn & inside(meeting) & (meeting.depths >= near_mm)
    return covered


def boundary_distance(
    corners: Float64, rig: Rig, grid: ViewGrid, pixels: Pixels
) -> tuple[Float64, Float64]:
    """Distance of pixel centres from each edge of a triangle's picture, in pixels.

    corners: [3, 3] mm; pixels: [pixel]. The triangle is first cut at the near plane,
    whose cut is an edge too. Returns distances [pixel, edge], in which a column and a row both
    count as 1, and k = D/d at the edge's nearest point, [pixel, edge]. A triangle that lies wholly
    before the near plane has no edges.
    """
    polygon = near_part(corners, rig.distance_mm - rig.near_mm)
    k = rig.distance_mm / (rig.distance_mm - polygon[:, 2])
    row_mm = grid.panel_mm[1] / grid.rows
    eye = rig.eye_x_mm[pixels.view][:, None]
    x_px = (
        k * polygon[:, 0] + (1.0 - k) * eye
    ) / grid.column_mm  # columns from the window's middle
    y_px = np.broadcast_to((0.5 * grid.panel_mm[1] - k * polygon[:, 1]) / row_mm, x_px.shape)
    corner_px = np.stack([x_px, y_px], axis=-1)  # [pixel, corner, xy]
    centre_column = pixels.column + 0.5 - grid.row_offset[pixels.row]
    centre_px = np.stack([centre_column, pixels.row + 0.5], axis=-1)[:, None, :]

    along = np.roll(corner_px, -1, axis=1) - corner_px
    length2 = np.sum(along * along, axis=-1)
    part = np.sum((centre_px - corner_px) * along, axis=-1) / np.where(length2 > 0.0, length2, 1.0)
    part = np.clip(part, 0.0, 1.0)
    nearest = corner_px + part[..., None] * along
    # 1/d, and so k, changes evenly along the picture of an edge.
    k_nearest = k + part * (np.roll(k, -1) - k)
    return np.linalg.norm(centre_px - nearest, axis=-1), k_nearest


def near_part(corners: Float64, most_z: float) -> Float64:
    """The part of a triangle [3, 3] with z ≤ most_z, as the corners of a polygon [n, 3], n ≤ 4."""
    polygon = []
    for p, q in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if p[2] <= most_z:
            polygon.append(p)
        if (p[2] <= most_z) != (q[2] <= most_z):
            cut = p + (most_z - p[2]) / (q[2] - p[2]) * (q - p)
            polygon.append(np.array([cut[0], cut[1], most_z]))
    return np.array(polygon).reshape(-1, 3)

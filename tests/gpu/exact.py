"""What each view pixel shows, by float64 rays against candidates; and the holes of a picture.

It is the reference's definition (`reference.raster`), each ray against the triangles whose boxes it
passes, all at once: quick enough for a hundred thousand triangles before a thousand cameras.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import Rig, ViewGrid
from lfd_render.reference import NO_TRIANGLE, Triangles, Visibility
from lfd_render.reference.raster import Rays, covers, meet

Float64 = NDArray[np.float64]
Int = NDArray[np.int64]

SPARE_PX = 1e-3  # of boxes, far above float64 rounding
INSIDE_PX = 1.0 / 128.0  # a hole lies more than this inside what covers it (hardware snaps to half)
FARTHER = 1e-4  # and shows something farther than that by more than this part of its depth


def nearest(
    triangles: Triangles, rig: Rig, grid: ViewGrid, across: float = 0.0, down: float = 0.0
) -> Visibility:
    """What pixels show, all triangles solid and opaque, their centres moved by parts of a pixel."""
    corners = triangles.p_display
    outlines = _outlines(corners, rig.distance_mm - rig.near_mm)
    k = rig.distance_mm / (rig.distance_mm - outlines[2])
    down_px = (0.5 - k * outlines[1] / grid.panel_mm[1]) * grid.rows - down
    index, row = _spans(down_px, np.zeros(len(corners)), grid.rows)
    k, k_x_mm = k[:, index], k[:, index] * outlines[0][:, index]
    ids = np.full((grid.rows, rig.views, grid.columns), NO_TRIANGLE, np.uint32)
    depths = np.full(ids.shape, np.inf)
    for view, eye_mm in enumerate(rig.eye_x_mm):
        across_px = (k_x_mm + (1.0 - k) * eye_mm) / grid.column_mm - across
        pair, column = _spans(across_px, grid.row_offset[row], grid.columns)
        at, at_row = index[pair], row[pair]
        x_mm = (column + 0.5 + across - grid.row_offset[at_row]) * grid.column_mm
        y_mm = grid.panel_mm[1] * (0.5 - (at_row + 0.5 + down) / grid.rows)
        through = Rays(np.full(len(at), eye_mm), x_mm, y_mm)
        meeting = meet(corners[at], through, rig.distance_mm)
        seen = np.flatnonzero(covers(meeting, triangles, at, rig.near_mm))
        pixel, depth_mm = at_row[seen] * grid.columns + column[seen], meeting.depths[seen]
        order = np.lexsort((at[seen], depth_mm, pixel))
        pixel, first = np.unique(pixel[order], return_index=True)
        place = pixel // grid.columns, view, pixel % grid.columns
        ids[place], depths[place] = at[seen][order[first]], depth_mm[order[first]]
    return Visibility(ids, depths)


def _outlines(corners: Float64, most_z: float) -> Float64:
    """Corners behind the near plane and cuts of edges by it, [xyz, point, triangle] of triangles
    [triangle, corner, xyz]; NaN for what a triangle has none of."""
    ends = np.ascontiguousarray(corners.transpose(2, 1, 0))
    behind = ends[2] <= most_z
    if behind.all():
        return ends
    after = np.roll(ends, -1, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        cuts = ends + (most_z - ends[2]) / (after[2] - ends[2]) * (after - ends)
    cuts[2] = most_z
    cuts[:, behind == np.roll(behind, -1, axis=0)] = np.nan
    return np.concatenate([np.where(behind, ends, np.nan), cuts], axis=1)


def _spans(places_px: Float64, offset_px: Float64, most: int) -> tuple[Int, Int]:
    """Every pixel in [0, most) whose centre lies among places [point, owner] + offset [owner]:
    owner, pixel."""
    low = np.fmin.reduce(places_px, axis=0) + offset_px - SPARE_PX - 0.5
    high = np.fmax.reduce(places_px, axis=0) + offset_px + SPARE_PX - 0.5
    first = np.clip(np.ceil(np.nan_to_num(low, nan=most)), 0, most).astype(np.int64)
    end = np.clip(np.floor(np.nan_to_num(high, nan=-1)) + 1, 0, most).astype(np.int64)
    count = np.maximum(end - first, 0)
    owner = np.flatnonzero(count)
    ends = np.cumsum(count[owner])
    within = np.arange(ends[-1] if len(ends) else 0) - np.repeat(ends - count[owner], count[owner])
    return np.repeat(owner, count[owner]), np.repeat(first[owner], count[owner]) + within


@dataclass(frozen=True, eq=False)
class Verdict:
    """Pixels [row, view, column] that are holes, those that show what is nowhere near, and the
    share of pixels that should show something."""

    holes: NDArray[np.bool_]
    ghosts: NDArray[np.bool_]
    covered: float


def judged(
    depths_mm: NDArray[np.float32], triangles: Triangles, rig: Rig, grid: ViewGrid
) -> Verdict:
    """Compare a picture's depths [row, view, column], ∞ for the background, with the exact ones.

    A hole shows something farther than all that covers the pixel's centre and the four places
    INSIDE_PX beside it, by more than FARTHER; a ghost something nearer than all of it.
    """
    found = depths_mm.astype(np.float64)
    exact = nearest(triangles, rig, grid).depths
    covered = float(np.isfinite(exact).mean())
    holes, ghosts = _beyond(found, exact)
    for across, down in ((-1, 0), (1, 0), (0, -1), (0, 1)):
        if not (holes.any() or ghosts.any()):
            break
        beside = nearest(triangles, rig, grid, INSIDE_PX * across, INSIDE_PX * down).depths
        farther, nearer = _beyond(found, beside)
        holes &= farther
        ghosts &= nearer
    return Verdict(holes, ghosts, covered)


def _beyond(found: Float64, exact: Float64) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    return found > exact * (1.0 + FARTHER), found < exact * (1.0 - FARTHER)

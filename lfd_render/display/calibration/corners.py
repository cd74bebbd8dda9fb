"""Where the panel lies in a photograph: its four corners, given or found, and the homography.

Photograph coordinates are pixels, x to the right and y downward, pixel centres at halves. Corners
stand in the order top left, top right, bottom right, bottom left, as the panel's viewer sees them.
A panel is found as the largest bright area on a darker ground; its sides are then measured where
the light passes the half between inside and outside, and cross in the corners.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lfd_render.errors import PictureError, UsageError

Float64 = NDArray[np.float64]
Pixels = NDArray[np.uint8]

ORDER = "top left, top right, bottom right, bottom left"
GIVEN_DOUBT_PX = 0.5  # of corners that a person points at
LEAST_DOUBT_PX = 0.15  # of corners found: blur, and the panel's own edge
LEAST_CONTRAST = 2.5  # light of the panel over that around it
LEAST_AREA = 0.02  # of the photograph
_CELLS = 240  # longer side of the coarse picture in which the panel is sought
_ALONG = 240  # places along a side
_CODES = np.arange(256) / 255
LINEAR = np.where(_CODES <= 0.04045, _CODES / 12.92, ((_CODES + 0.055) / 1.055) ** 2.4)


@dataclass(frozen=True, eq=False)
class Corners:
    """xy_px: float64 [4, 2]; doubt_px: standard uncertainty of each coordinate.

    inset: part of the panel's width by which the corners lie inside it, left and right.
    """

    xy_px: Float64
    doubt_px: float
    inset: float = 0.0
    found: bool = False

    def photo_from_panel(self) -> Float64:
        """Homography of (u, v from the top, 1) to photograph pixels, [3, 3]."""
        left, right = self.inset, 1 - self.inset
        unit = np.array([[left, 0.0], [right, 0.0], [right, 1.0], [left, 1.0]])
        rows = []
        for (u, v), (x, y) in zip(unit, self.xy_px, strict=True):
            rows.append([u, v, 1, 0, 0, 0, -u * x, -v * x])
            rows.append([0, 0, 0, u, v, 1, -u * y, -v * y])
        found = np.linalg.solve(np.array(rows, np.float64), self.xy_px.reshape(8))
        return np.append(found, 1.0).reshape(3, 3)

    def lit_by(self, lenses: float, rise: float) -> Corners:
        """The same corners as those of the lenses that are lit, of `lenses` across the panel, the
        sheet drifting by `rise` of them over its height; corners that were given stay.

        The edge cuts lenses, and one of which less than half is left sends no light forward: on
        average an eighth of a lens is dark, 0.16 the standard deviation, at each side.
        """
        if not self.found:
            return self
        lens_px = float(np.hypot(*(self.xy_px[1] - self.xy_px[0]))) / lenses
        doubt = float(np.hypot(self.doubt_px, 0.16 * lens_px / max(1.0, abs(rise))))
        return replace(self, doubt_px=doubt, inset=1 / (8 * lenses))


def given_corners(
    xy_px: list[tuple[float, float]], size_px: tuple[int, int] | None = None
) -> Corners:
    """Corners that a person gives; raises UsageError for those that are no panel's."""
    xy = np.array(xy_px, np.float64)
    if xy.shape != (4, 2) or not np.isfinite(xy).all():
        raise UsageError(f"corners: {xy_px}; give four points x,y in photograph pixels: {ORDER}")
    edge = np.roll(xy, -1, axis=0) - xy
    following = np.roll(edge, -1, axis=0)
    turns = edge[:, 0] * following[:, 1] - edge[:, 1] * following[:, 0]
    if not (turns > 0).all():
        flat = np.abs(turns).min() < 1e-6 * np.abs(turns).max() + 1e-9
        what = "three of them lie on a line" if flat else "they are out of order"
        raise UsageError(f"corners: {_listed(xy)}: {what}; give {ORDER}, y counted downward")
    if xy[0, 0] + xy[3, 0] >= xy[1, 0] + xy[2, 0] or xy[0, 1] + xy[1, 1] >= xy[2, 1] + xy[3, 1]:
        raise UsageError(
            f"corners: {_listed(xy)}: they begin at another corner; give {ORDER}, of a photograph "
            "that stands upright"
        )
    if size_px is not None:
        width, height = size_px
        margin = 0.02 * max(size_px)
        low, high = xy.min(axis=0), xy.max(axis=0)
        if (low < -margin).any() or high[0] > width + margin or high[1] > height + margin:
            raise UsageError(
                f"corners: {_listed(xy)} lie outside the photograph of {width} x {height} pixels; "
                "give pixels of the photograph"
            )
    return Corners(xy, GIVEN_DOUBT_PX)


def find_corners(pixels: Pixels, name: str) -> Corners:
    """Corners of the bright panel in a photograph, uint8 [y, x, 3]; raises PictureError."""
    light = linear_light(pixels)
    remedy = "photograph the white pattern in a dark room, all of the panel in it, or give corners"
    rough = _rough_corners(light, name, remedy)
    reach = 0.04 * float(np.hypot(*(rough[2] - rough[0])))
    scatter = 0.0
    for width in (reach, reach / 3, reach / 6):
        rough, scatter = _measured(light, rough, max(5.0, width), name, remedy)
    try:
        xy = given_corners([(float(x), float(y)) for x, y in rough], pixels.shape[1::-1]).xy_px
    except UsageError as cause:
        raise PictureError(f"{name}: no panel of four corners is found; {remedy}") from cause
    return Corners(xy, max(LEAST_DOUBT_PX, scatter), found=True)


def linear_light(pixels: Pixels) -> Float64:
    """Light of a photograph's three channels together, [y, x], decoded as sRGB."""
    light: Float64 = LINEAR[pixels[..., 0]]
    light += LINEAR[pixels[..., 1]]
    light += LINEAR[pixels[..., 2]]
    return light


def _rough_corners(light: Float64, name: str, remedy: str) -> Float64:
    """Extreme points of the largest bright area along the diagonals, [4, 2]."""
    height, width = light.shape
    cell = max(1, -(-max(height, width) // _CELLS))
    rows, columns = height // cell, width // cell
    if min(rows, columns) < 8:
        raise PictureError(f"{name}: has {width} x {height} pixels, too few to find a panel in")
    coarse = light[: rows * cell, : columns * cell].reshape(rows, cell, columns, cell).mean((1, 3))
    level = _otsu(coarse)
    bright, dark = coarse > level, coarse <= level
    parted = bright.any() and dark.any()
    contrast = coarse[bright].mean() / max(coarse[dark].mean(), 1e-9) if parted else 1.0
    area = _largest(bright)
    if contrast < LEAST_CONTRAST or area.mean() < LEAST_AREA:
        raise PictureError(
            f"{name}: no bright panel on a darker ground is found (light {contrast:.2g} times the "
            f"ground's, it should be {LEAST_CONTRAST:g}); {remedy}"
        )
    if area[[0, -1]].any() or area[:, [0, -1]].any():
        raise PictureError(f"{name}: the bright panel reaches the photograph's edge; {remedy}")
    y, x = np.nonzero(area)
    ends = [np.argmin(x + y), np.argmax(x - y), np.argmax(x + y), np.argmin(x - y)]
    found: Float64 = np.stack([x[ends] + 0.5, y[ends] + 0.5], axis=1) * float(cell)
    return found


def _otsu(values: Float64) -> float:
    """The level that parts values into two classes of the least variance within."""
    counts, edges = np.histogram(values, 256)
    centres = (edges[1:] + edges[:-1]) / 2
    below, above = np.cumsum(counts), values.size - np.cumsum(counts)
    total = np.cumsum(counts * centres)
    with np.errstate(invalid="ignore", divide="ignore"):
        between = below * above * (total / below - (total[-1] - total) / above) ** 2
    return float(edges[1:][np.nanargmax(np.where(np.isfinite(between), between, -1.0))])


def _largest(bright: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The largest connected area."""
    rows, columns = bright.shape
    left = bright.copy()
    best: list[tuple[int, int]] = []
    for start in zip(*np.nonzero(bright), strict=True):
        if not left[start]:
            continue
        left[start] = False
        area, queue = [start], deque([start])
        while queue:
            y, x = queue.popleft()
            for near in ((y - 1, x), (y + 1, x), (y, x - 1), (y, x + 1)):
                if 0 <= near[0] < rows and 0 <= near[1] < columns and left[near]:
                    left[near] = False
                    area.append(near)
                    queue.append(near)
        best = max(best, area, key=len)
    found = np.zeros_like(bright)
    if best:
        found[tuple(np.array(best).T)] = True
    return found


def _measured(
    light: Float64, corners: Float64, reach: float, name: str, remedy: str
) -> tuple[Float64, float]:
    """Corners in which the measured sides cross, and the uncertainty that their scatter leaves."""
    lines, scatter = [], 0.0
    middle = corners.mean(axis=0)
    for side in range(4):
        start, end = corners[side], corners[(side + 1) % 4]
        along = end - start
        inward = np.array([-along[1], along[0]]) / max(np.hypot(*along), 1e-9)
        assert inward @ (middle - start) > 0
        place = np.linspace(0.06, 0.94, _ALONG)
        depth = np.arange(-reach, reach + 0.25, 0.5)
        at = start + place[:, None, None] * along + depth[None, :, None] * inward
        profile = _bilinear(light, at)
        quarter = max(1, len(depth) // 4)
        outside = np.median(profile[:, :quarter])
        inside = np.median(profile[:, -quarter:])
        if not inside > LEAST_CONTRAST * max(outside, 1e-9) * 0.8:
            raise PictureError(f"{name}: a side of the panel has no clear edge; {remedy}")
        # The mean depth of an edge is the area above it: less noisy than a crossing.
        share = np.clip((profile - outside) / (inside - outside), -1, 2)
        edge = depth[-1] + 0.25 - 0.5 * share.sum(axis=1)
        line, spread = _line(place, edge)
        scatter = max(scatter, spread)
        lines.append((start + line[0] * inward, along + line[1] * inward))
    found = np.empty((4, 2))
    for corner in range(4):
        (p, d), (q, e) = lines[corner - 1], lines[corner]
        t = np.linalg.solve(np.stack([d, -e], axis=1), q - p)
        found[corner] = p + t[0] * d
    return found, scatter


def _line(place: Float64, edge: Float64) -> tuple[Float64, float]:
    """Offset and slope of an edge along a side, without outliers, and the ends' uncertainty."""
    design = np.stack([np.ones_like(place), place], axis=1)
    keep = np.ones(len(place), np.bool_)
    line = np.zeros(2)
    residual: Float64 = edge
    for _ in range(4):
        line[:] = np.linalg.lstsq(design[keep], edge[keep], rcond=None)[0]
        residual = np.asarray(edge - design @ line, np.float64)
        spread = 1.4826 * float(np.median(np.abs(residual - np.median(residual))))
        keep = np.abs(residual) <= 3 * max(spread, 0.05)
    return line, float(residual[keep].std()) * 2 / float(np.sqrt(keep.sum() / 4))


def _bilinear(light: Float64, at: Float64) -> Float64:
    """Light at points (x, y), [..., 2]; the nearest pixel's beyond the edge."""
    height, width = light.shape
    x = np.clip(at[..., 0] - 0.5, 0, width - 1.001)
    y = np.clip(at[..., 1] - 0.5, 0, height - 1.001)
    column, row = x.astype(np.int64), y.astype(np.int64)
    right, down = x - column, y - row
    top = light[row, column] * (1 - right) + light[row, column + 1] * right
    bottom = light[row + 1, column] * (1 - right) + light[row + 1, column + 1] * right
    found: Float64 = top * (1 - down) + bottom * down
    return found


def _listed(xy: Float64) -> str:
    return " ".join(f"{x:g},{y:g}" for x, y in xy)

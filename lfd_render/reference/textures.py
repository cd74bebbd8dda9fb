"""Textures: sRGB decoding, mip chains, trilinear filtering, and the rules for levels of detail."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Float64 = NDArray[np.float64]
Int = NDArray[np.int64]

MOST_ASPECT = 16  # of an ellipse that taps are as wide as
TAPS_PER_WIDTH = 0.7  # of the ellipse's short axis, along its long one


def linear_from_srgb(encoded: Float64) -> Float64:
    """sRGB values 0…1 → linear light (IEC 61966-2-1)."""
    high = ((np.maximum(encoded, 0.04045) + 0.055) / 1.055) ** 2.4
    return np.where(encoded <= 0.04045, encoded / 12.92, high)


def mip_chain(pixels: NDArray[np.uint8], *, srgb: bool) -> list[Float64]:
    """Levels of a picture, uint8 [y, x, 4] → linear float64 [y, x, 4] each, the finest first.

    Each level halves the one before, rounding down to at least 1, and a texel is the mean of the
    area that it covers. Alpha is linear in sRGB pictures too.
    """
    level = pixels.astype(np.float64) / 255.0
    if srgb:
        level[..., :3] = linear_from_srgb(level[..., :3])
    levels = [level]
    while max(level.shape[:2]) > 1:
        height, width = (max(1, size // 2) for size in level.shape[:2])
        rows, columns = (
            _means(size, to) for size, to in zip(level.shape[:2], (height, width), strict=True)
        )
        level = np.einsum("yr,xc,rcn->yxn", rows, columns, level)
        levels.append(level)
    return levels


def _means(size: int, to: int) -> Float64:
    """Weights [to, size] by which `to` equal parts of a line average its `size` texels."""
    edges = np.arange(to + 1) * size / to
    texels = np.arange(size)
    overlap = np.minimum(edges[1:, None], texels + 1) - np.maximum(edges[:-1, None], texels)
    weights: Float64 = np.clip(overlap, 0.0, None) * to / size
    return weights


def sampled(levels: Sequence[Float64], uv: Float64, lod: Float64, wrap: tuple[str, str]) -> Float64:
    """Trilinear samples [n, 4] at texture coordinates [n, 2] and levels of detail [n].

    (0, 0) is the first texel's outer corner and v runs down the picture; levels of detail below the
    finest magnify it, those beyond the coarsest repeat it (OpenGL 4.5, section 8.14).
    """
    lod = np.clip(lod, 0.0, len(levels) - 1)
    finer = np.floor(lod).astype(np.int64)
    result = np.zeros((len(uv), 4))
    for index, level in enumerate(levels):
        weight = np.where(finer == index, 1.0 - (lod - finer), 0.0)
        weight += np.where(finer + 1 == index, lod - finer, 0.0)
        used = weight > 0.0
        result[used] += weight[used, None] * _bilinear(level, uv[used], wrap)
    return result


def _bilinear(level: Float64, uv: Float64, wrap: tuple[str, str]) -> Float64:
    height, width = level.shape[:2]
    at = uv * (width, height) - 0.5
    first = np.floor(at).astype(np.int64)
    x1, y1 = (at - first)[:, :1], (at - first)[:, 1:]
    left, right = (wrapped(first[:, 0] + step, width, wrap[0]) for step in (0, 1))
    upper, lower = (wrapped(first[:, 1] + step, height, wrap[1]) for step in (0, 1))
    above = (1.0 - x1) * level[upper, left] + x1 * level[upper, right]
    below = (1.0 - x1) * level[lower, left] + x1 * level[lower, right]
    mixed: Float64 = (1.0 - y1) * above + y1 * below
    return mixed


def wrapped(index: Int, size: int, wrap: str) -> Int:
    """Texel indices beyond the picture, brought inside: repeat, clamp to the edge, or mirror."""
    if wrap == "clamp":
        return np.clip(index, 0, size - 1)
    if wrap == "mirror":
        period = index % (2 * size)
        return np.minimum(period, 2 * size - 1 - period)
    return index % size


@dataclass(frozen=True, eq=False)
class Footprints:
    """Texture coordinates [n, 2] and their changes over a column (dx) and a row (dy).

    views: [n, 3], the areas of the smallest and the largest footprint that any view has there, over
    this one's, and the weight of the larger one's texel (`among_views`).
    """

    uv: Float64
    dx: Float64
    dy: Float64
    views: Float64


def filtered(
    levels: Sequence[Float64], at: Footprints, wrap: tuple[str, str], rule: str
) -> Float64:
    """Texels [n, 4] over footprints: by `none` (level 0), `area`, `long-axis`, `multiview` or
    `anisotropic`."""
    height, width = levels[0].shape[:2]
    dx, dy = at.dx * (width, height), at.dy * (width, height)
    if rule == "none":
        return sampled(levels, at.uv, np.zeros(len(dx)), wrap)
    if rule == "long-axis":
        return sampled(levels, at.uv, long_axis_lod(dx, dy), wrap)
    if rule == "area":
        return sampled(levels, at.uv, area_lod(dx, dy), wrap)
    if rule == "multiview":
        # Equations 6, 7 and 9: a level for the smallest footprint and one for the largest.
        own = area_lod(dx, dy)
        least, most = (
            sampled(levels, at.uv, own + 0.5 * np.log2(at.views[:, n]), wrap) for n in (0, 1)
        )
        return np.asarray(least + (most - least) * at.views[:, 2:])
    assert rule == "anisotropic", rule
    return _anisotropic(levels, at.uv, dx, dy, wrap)


def area_lod(dx: Float64, dy: Float64) -> Float64:
    """Level of detail at which a pixel's footprint has a texel's area, [n].

    dx, dy: [n, 2], change over a column and a row in texels. Half the logarithm of the area in
    texels (equation 6 of Gavane and Watson 2024): a level quarters the texels. Footprints without
    area are taken as 1e-12 texels.
    """
    area = np.abs(dx[:, 0] * dy[:, 1] - dx[:, 1] * dy[:, 0])
    return np.asarray(0.5 * np.log2(np.maximum(area, 1e-12)))


def long_axis_lod(dx: Float64, dy: Float64) -> Float64:
    """Level of detail at which a texel is as long as the longer change (OpenGL 4.5, 8.14.1)."""
    longer = np.maximum(np.linalg.norm(dx, axis=1), np.linalg.norm(dy, axis=1))
    return np.asarray(np.log2(np.maximum(longer, 1e-6)))


def ellipses(dx: Float64, dy: Float64) -> tuple[Float64, Float64, Float64]:
    """Axes of a pixel's circle on the texture: long and short diameter in texels [n], and the unit
    direction of the long one [n, 2]: singular values and left vectors of [dx dy]."""
    left, values, _ = np.linalg.svd(np.stack([dx, dy], axis=-1))
    return values[:, 0], values[:, 1], left[:, :, 0]


def _anisotropic(
    levels: Sequence[Float64], uv: Float64, dx: Float64, dy: Float64, wrap: tuple[str, str]
) -> Float64:
    """The mean of taps as wide as the ellipse is short, or a texel, evenly along it,
    TAPS_PER_WIDTH for each such width; they are wider where MOST_ASPECT widths do not reach."""
    long, short, direction = ellipses(dx, dy)
    ratio = np.clip(long / np.maximum(short, 1.0), 1.0, MOST_ASPECT)
    count = np.ceil(TAPS_PER_WIDTH * ratio)
    lod = np.log2(np.maximum(long, 1e-6) / ratio)
    height, width = levels[0].shape[:2]
    total = np.zeros((len(uv), 4))
    for tap in range(MOST_ASPECT):
        used = tap < count
        along = ((tap + 0.5) / count - 0.5) * long
        at = uv + along[:, None] * direction / (width, height)
        total[used] += sampled(levels, at[used], lod[used], wrap) / count[used, None]
    return total


def among_views(areas: Float64, own: Float64, splat: Float64) -> Float64:
    """Footprints.views, [n, 3], of points seen in several views.

    areas: [n, view], what a view's pixel covers on the surface, NaN where the view does not see
    that side; own: [n], that of the view in question; splat: [n], what the splat covers there, in
    the same unit. Equations 4, 5, 8 and 9 of Gavane and Watson 2024; where all footprints are
    alike the weight 0/0 is 0.
    """
    least = np.fmin(np.fmin.reduce(areas, axis=1), own)
    most = np.fmax(np.fmax.reduce(areas, axis=1), own)
    # Equation 8: a splat's area grows to the pixel's where it covers but a part of it.
    use = np.clip(splat / np.minimum(1.0, splat / own), least, most)
    alike = most <= least
    weight = np.where(alike, 0.0, (use - least) / np.where(alike, 1.0, most - least))
    return np.stack([least / own, most / own, weight], axis=-1)

"""Textures: sRGB decoding, mip chains, and trilinear filtering with a given level of detail."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Float64 = NDArray[np.float64]
Int = NDArray[np.int64]


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


def area_lod(uv_dx: Float64, uv_dy: Float64, size: tuple[int, int]) -> Float64:
    """Level of detail at which a pixel's footprint has a texel's area, [n].

    uv_dx, uv_dy: [n, 2], change of the coordinate over a column and a row; size: texels across and
    down. Half the logarithm of the area in texels (equation 6 of Gavane and Watson 2024): a level
    quarters the texels. Footprints without area are taken as 1e-12 texels.
    """
    area = np.abs(uv_dx[:, 0] * uv_dy[:, 1] - uv_dx[:, 1] * uv_dy[:, 0]) * size[0] * size[1]
    return np.asarray(0.5 * np.log2(np.maximum(area, 1e-12)))

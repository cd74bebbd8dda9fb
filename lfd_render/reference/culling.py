"""Stochastic culling: which tiny triangles the paper keeps (Gavane and Watson 2023, 3.2)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import Rig, ViewGrid
from lfd_render.reference.points import densest_pixel_mm2
from lfd_render.reference.transform import Triangles

Float64 = NDArray[np.float64]
Int = NDArray[np.int64]

SMALLEST_AREA = 0.1  # pixels; smaller triangles are kept with probability 10·area


def areas_px(triangles: Triangles, rig: Rig, grid: ViewGrid) -> Float64:
    """Area of each triangle in pixels of the view that sees it densest, [triangle]."""
    edges = triangles.p_display[:, 1:] - triangles.p_display[:, :1]
    area_mm2 = 0.5 * np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=-1)
    pixels_mm2 = [densest_pixel_mm2(corners, rig, grid) for corners in triangles.p_display]
    return np.asarray(area_mm2 / np.array(pixels_mm2))


def kept(area_px: Float64, seed: int) -> NDArray[np.bool_]:
    """Which triangles stay, [triangle]: by a hash of id and seed, so a frame can be repeated."""
    ids = np.arange(len(area_px))
    drawn = hash_unit(ids, np.full_like(ids, seed), np.zeros_like(ids))
    return (area_px >= SMALLEST_AREA) | (drawn < 10.0 * area_px)


def hash_unit(x: Int, y: Int, z: Int) -> Float64:
    """Hash of three words to [0, 1): the output permutation of PCG (O'Neill 2014, RXS-M-XS) on a
    mix of them, modulo 2³²."""
    low = np.uint64(0xFFFFFFFF)
    factors = (747796405, 2891336453, 277803737)
    state: NDArray[np.uint64] = np.full(len(x), 1, np.uint64)
    for word, factor in zip((x, y, z), factors, strict=True):
        mixed = state + (word.astype(np.uint64) & low) * np.uint64(factor)
        state = (mixed & low).astype(np.uint64)
    shift = (state >> np.uint64(28)) + np.uint64(4)
    turned = (((state >> shift) ^ state) * np.uint64(277803737)) & low
    return np.asarray(((turned >> np.uint64(22)) ^ turned).astype(np.float64) / 2.0**32)

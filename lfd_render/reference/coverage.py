"""Alpha: which view pixels a surface that is not opaque counts at.

Masks cut at their cutoff. Blended surfaces use ordered coverage: a pixel's thresholds over its
views are a golden-ratio sequence, evenly spread over [0, 1), so that as many views show the surface
as its opacity says and eyes between views see the mean.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lfd_render.reference.raster import Pixels
from lfd_render.scene import Material

Float64 = NDArray[np.float64]
Int = NDArray[np.int64]
Bool = NDArray[np.bool_]

GOLDEN_RATIO = 0.61803399


def accepted(material: Material, index: int, alpha: Float64, pixels: Pixels, seed: int) -> Bool:
    """Whether pixels [n] of opacity alpha count; index: of the material, seed: of the frame."""
    if material.alpha_mode == "opaque":
        return np.ones(len(alpha), bool)
    if material.alpha_mode == "mask":
        return alpha >= material.alpha_cutoff
    return alpha > blend_threshold(index, pixels, seed)


def blend_threshold(index: int, pixels: Pixels, seed: int) -> Float64:
    """Thresholds [n] in [0, 1) of blended pixels: a hash of pixel and material, then a sequence."""
    material = np.full(len(pixels.row), index)
    start = hash_unit(pixels.column + seed * 65537, pixels.row, material)
    return np.asarray((start + GOLDEN_RATIO * pixels.view) % 1.0)


def hash_unit(x: Int, y: Int, z: Int) -> Float64:
    """Hash of three words to [0, 1): the output permutation of PCG (O'Neill 2014, RXS-M-XS) on a
    mix of them, modulo 2³²."""
    words = [np.asarray(word).astype(np.uint64) & np.uint64(0xFFFFFFFF) for word in (x, y, z)]
    factors = (747796405, 2891336453, 277803737)
    state = np.uint64(1) + sum(w * np.uint64(f) for w, f in zip(words, factors, strict=True))
    state &= np.uint64(0xFFFFFFFF)
    shift = (state >> np.uint64(28)) + np.uint64(4)
    word = (((state >> shift) ^ state) * np.uint64(277803737)) & np.uint64(0xFFFFFFFF)
    return np.asarray(((word >> np.uint64(22)) ^ word).astype(np.float64) / 2.0**32)

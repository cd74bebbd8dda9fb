"""The built-in light: a ceiling, a floor, two soft boxes and a key light, all far away; +y is up.

This is the definition of the studio; its numbers are a design and have no other source.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lfd_render.reference.lights import Arrival

Float64 = NDArray[np.float64]

CEILING = np.array([0.62, 0.66, 0.74])  # radiance from straight above
HORIZON = np.array([0.34, 0.34, 0.36])
FLOOR = np.array([0.13, 0.12, 0.11])
HORIZON_WIDTH = 0.15  # half width of the step between floor and horizon, in the direction's y

# Soft boxes: direction to each, radiance at its middle, and sharpness λ of its spherical Gaussian.
BOX_DIRECTIONS = np.array([[-0.5063697, 0.5625, 0.6534], [0.8320503, 0.3328, -0.4438]])
BOX_RADIANCES = np.array([[5.0, 4.7, 4.3], [2.2, 2.6, 3.4]])
BOX_SHARPNESSES = np.array([40.0, 60.0])

KEY_DIRECTION = np.array([-0.4423954, 0.6635931, 0.6032666])
KEY_IRRADIANCE = np.array([2.1, 2.0, 1.85])  # on a surface that faces it


def radiance(directions: Float64, roughness: Float64) -> Float64:
    """Light [n, 3] that arrives from directions [n, 3], averaged over the lobe of a roughness [n].

    The lobe of GGX is taken as a spherical Gaussian of sharpness μ = 2/α², α = roughness² (Wang et
    al. 2009, "All-frequency rendering of dynamic, spatially-varying reflectance", section 4.2); a
    box of sharpness λ blurred by it has about λμ/(λ + μ), at an unchanged integral (section 4.1).
    """
    light = gradient(directions[:, 1], HORIZON_WIDTH + roughness)
    lobe = 2.0 / np.maximum(1e-3, roughness**4)
    for to_box, middle, sharpness in zip(
        BOX_DIRECTIONS, BOX_RADIANCES, BOX_SHARPNESSES, strict=True
    ):
        blurred = sharpness * lobe / (sharpness + lobe)
        falloff = blurred / sharpness * np.exp(blurred * (directions @ to_box - 1.0))
        light += falloff[:, None] * middle
    return light


def diffuse(normals: Float64) -> Float64:
    """Light [n, 3] that a white diffuse surface of normals [n, 3] sends on: irradiance/π.

    The gradient at its widest stands for its cosine-weighted mean; a box counts by its solid angle
    2π/λ.
    """
    light = gradient(normals[:, 1], np.ones(len(normals)))
    for to_box, middle, sharpness in zip(
        BOX_DIRECTIONS, BOX_RADIANCES, BOX_SHARPNESSES, strict=True
    ):
        cosine = np.maximum(0.0, normals @ to_box)
        light += (2.0 * np.pi / sharpness * cosine / np.pi)[:, None] * middle
    return light


def key() -> list[Arrival]:
    """The key light, which shines in scenes without lights of their own."""
    return [Arrival(KEY_DIRECTION, KEY_IRRADIANCE)]


def gradient(up: Float64, width: Float64) -> Float64:
    """Floor to horizon to ceiling by a direction's y, [n, 3]; width [n] softens the steps."""
    ceiling = _step(0.0, 1.0 + width, up)[:, None]
    above = _step(-width, width, up)[:, None]
    upper = (1.0 - ceiling) * HORIZON + ceiling * CEILING
    return np.asarray((1.0 - above) * FLOOR + above * upper)


def _step(low: Float64 | float, high: Float64, value: Float64) -> Float64:
    """The cubic that rises from 0 at low to 1 at high, level at both."""
    t = np.clip((value - low) / (high - low), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)

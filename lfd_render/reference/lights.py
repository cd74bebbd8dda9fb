"""Light from single directions: the punctual lights of glTF's extension KHR_lights_punctual."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lfd_render.scene import Light

Float64 = NDArray[np.float64]

NARROWEST = 1e-3  # least difference of a spot's cosines, as the extension advises
MOST_IRRADIANCE = 1e20  # of a surface that touches a light


class Arrival(NamedTuple):
    """Unit directions toward a light, and the irradiance on surfaces that face it.

    Each [point, 3], or [3] where all points have the same.
    """

    directions: Float64
    irradiance: Float64


def arriving(light: Light, points: Float64) -> Arrival:
    """A light as it comes to points [n, xyz] of the world.

    Irradiance is the intensity in lux of a directional light; of others it is the intensity in
    candela over the square of the distance, by the range's window and the cone's fall.
    """
    axis = -light.world_from_light[:3, 2]
    axis = axis / max(float(np.linalg.norm(axis)), np.finfo(np.float64).tiny)
    power = np.array(light.color) * light.intensity
    if light.kind == "directional":
        return Arrival(np.tile(-axis, (len(points), 1)), np.tile(power, (len(points), 1)))
    to_light = light.world_from_light[:3, 3] - points
    distance = np.linalg.norm(to_light, axis=1)
    directions = to_light / np.maximum(distance, 1e-100)[:, None]
    share = window(light, distance) * cone(light, -directions @ axis)
    return Arrival(directions, np.minimum(share[:, None] * power, MOST_IRRADIANCE))


def window(light: Light, distance: Float64) -> Float64:
    """1/m² by which candela become lux at distances [n]: the inverse square, cut at the range."""
    reach = 0.0 if light.range is None else (distance / light.range) ** 4
    return np.asarray(np.clip(1.0 - reach, 0.0, 1.0) / np.maximum(distance, 1e-100) ** 2)


def cone(light: Light, cosine: Float64) -> Float64:
    """Share of a spot's intensity at cosines [n] from its axis: all of it within the inner angle,
    none beyond the outer, between them a square in the cosine."""
    if light.kind != "spot":
        return np.ones_like(cosine)
    inner, outer = np.cos(light.inner_cone_rad), np.cos(light.outer_cone_rad)
    fall = np.clip((cosine - outer) / max(NARROWEST, inner - outer), 0.0, 1.0)
    return np.asarray(fall**2)

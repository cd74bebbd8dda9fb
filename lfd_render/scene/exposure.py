"""Exposure for a scene's own lights, whose units are lux and candela."""

from __future__ import annotations

import math

import numpy as np

from lfd_render.scene.model import Light, Scene

BRIGHT = 8.0  # times white, from which the tone curve leaves hardly any picture


def white_under_lights(scene: Scene) -> float:
    """Radiance of a white diffuse surface in the scene's middle that faces all of its lights.

    Lights nearer to the middle than half the radius of the scene's box count as standing there;
    ranges and cones are not looked at.
    """
    low, high = scene.bounds()
    middle, nearest = (low + high) / 2.0, float(np.linalg.norm(high - low)) / 4.0
    return sum(_irradiance(light, middle, nearest) for light in scene.lights) / math.pi


def exposure_hint(scene: Scene) -> str | None:
    """A line for the person if lights make white far brighter than a picture's white, or None."""
    white = white_under_lights(scene)
    if not BRIGHT < white < math.inf:
        return None
    stops = round(2.0 * math.log2(white)) / 2.0
    return (
        f"lights: they make white about {white:.3g} times as bright as the picture's; "
        f"try --exposure -{stops:g}EV"
    )


def _irradiance(light: Light, place: np.ndarray, nearest: float) -> float:
    """Largest channel, in lux."""
    power = max(light.color) * light.intensity
    if light.kind == "directional":
        return power
    distance = float(np.linalg.norm(light.world_from_light[:3, 3] - place))
    return power / max(distance, nearest, 1e-18) ** 2

"""Light from all around: what an environment must tell, and pictures of one.

Nothing is tabulated here: each direction's light is integrated over the picture, which is slow.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from lfd_render.reference.lights import Arrival
from lfd_render.reference.textures import sampled

Float64 = NDArray[np.float64]

# Of the order-2 harmonics (Ramamoorthi and Hanrahan 2001): Y00, Y1m, Y2m and Y20 of equation 3, and
# the cosine lobe's weights of bands 0, 1 and 2 of equation 8.
Y00, Y1, Y2, Y20, Y22 = 0.282095, 0.488603, 1.092548, 0.315392, 0.546274
BAND_WEIGHTS = np.array([np.pi] + 3 * [2.0 * np.pi / 3.0] + 5 * [np.pi / 4.0])
LOBE_SAMPLES = 2048
GRID = (256, 512)  # rows, columns of the directions that the harmonics are summed over


class Environment(Protocol):
    """Light from far away. The module `studio` is one."""

    def radiance(self, directions: Float64, roughness: Float64) -> Float64:
        """Light [n, 3] that a surface of roughness [n] mirrors along directions [n, 3]."""
        ...

    def diffuse(self, normals: Float64) -> Float64:
        """Light [n, 3] that a white diffuse surface of normals [n, 3] sends on: irradiance/π."""
        ...

    def key(self) -> Sequence[Arrival]:
        """Lights of its own, for scenes that have none."""
        ...


@dataclass(frozen=True)
class Adjusted:
    """An environment turned about +y, counter-clockwise seen from above, and scaled."""

    base: Environment
    turn_rad: float = 0.0
    intensity: float = 1.0

    def radiance(self, directions: Float64, roughness: Float64) -> Float64:
        """See Environment."""
        return self.intensity * self.base.radiance(directions @ self._turn, roughness)

    def diffuse(self, normals: Float64) -> Float64:
        """See Environment."""
        return self.intensity * self.base.diffuse(normals @ self._turn)

    def key(self) -> list[Arrival]:
        """See Environment."""
        return [
            Arrival(light.directions @ self._turn.T, self.intensity * light.irradiance)
            for light in self.base.key()
        ]

    @property
    def _turn(self) -> Float64:
        """The matrix by which a column of the environment comes into the world."""
        cos, sin = np.cos(self.turn_rad), np.sin(self.turn_rad)
        return np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])


class Darkness:
    """No light at all."""

    def radiance(self, directions: Float64, _roughness: Float64) -> Float64:
        """See Environment."""
        return np.zeros_like(directions)

    def diffuse(self, normals: Float64) -> Float64:
        """See Environment."""
        return np.zeros_like(normals)

    def key(self) -> list[Arrival]:
        """See Environment."""
        return []


class Panorama:
    """An equirectangular picture [y, x, 3]; see `direction_place` for its convention."""

    def __init__(self, pixels: NDArray[np.floating]) -> None:
        opaque = np.ones((*pixels.shape[:2], 1))
        self._levels = [np.concatenate([pixels.astype(np.float64), opaque], axis=-1)]

    def seen(self, directions: Float64) -> Float64:
        """The picture itself, [n, 3], bilinear between texels."""
        place = direction_place(directions)
        return sampled(self._levels, place, np.zeros(len(place)), ("repeat", "clamp"))[:, :3]

    def radiance(self, directions: Float64, roughness: Float64) -> Float64:
        """Σ L(l)·(n·l) / Σ n·l over the GGX lobe of an eye that looks straight down on n (Karis
        2013, "Real shading in Unreal Engine 4")."""
        return np.array(
            [self._lobe(d, float(r)) for d, r in zip(directions, roughness, strict=True)]
        )

    def _lobe(self, direction: Float64, roughness: float) -> Float64:
        if roughness == 0.0:
            return np.asarray(self.seen(direction[None])[0])
        lobe = ggx_lobe(roughness, LOBE_SAMPLES)
        light = self.seen(lobe @ basis(direction))
        mean: Float64 = lobe[:, 2] @ light / lobe[:, 2].sum()
        return mean

    def diffuse(self, normals: Float64) -> Float64:
        """E(n)/π of the harmonics to order 2 (equation 7 there), which ring below 0 round a small
        bright light; clamped."""
        shares = harmonics(normals) * BAND_WEIGHTS / np.pi
        return np.asarray(np.maximum(0.0, shares @ self._coefficients))

    def key(self) -> list[Arrival]:
        """A picture holds all its lights."""
        return []

    @cached_property
    def _coefficients(self) -> Float64:
        """The picture's harmonics [9, 3]."""
        rows, columns = GRID
        theta = (np.arange(rows) + 0.5) * np.pi / rows
        phi = (np.arange(columns) + 0.5) * 2.0 * np.pi / columns
        theta, phi = (a.ravel() for a in np.meshgrid(theta, phi, indexing="ij"))
        directions = np.stack(
            [np.sin(theta) * np.cos(phi), np.cos(theta), np.sin(theta) * np.sin(phi)], axis=-1
        )
        solid_angle = np.sin(theta)
        solid_angle *= 4.0 * np.pi / solid_angle.sum()
        light = self.seen(directions) * solid_angle[:, None]
        coefficients: Float64 = harmonics(directions).T @ light
        return coefficients


def direction_place(directions: Float64) -> Float64:
    """Texture coordinates [n, 2] of directions [n, 3]: u = ½ + atan2(z, x)/2π, v = acos(y)/π from
    the top row down, as in the Khronos glTF viewer."""
    x, y, z = directions.T
    u = 0.5 + np.arctan2(z, x) / (2.0 * np.pi)
    return np.stack([u, np.arctan2(np.hypot(x, z), y) / np.pi], axis=-1)


def ggx_lobe(roughness: float, samples: int) -> Float64:
    """Directions [n, 3] about +z in which GGX mirrors an eye on +z, those above the surface.

    Half vectors by the distribution's inverse (Walter et al. 2007, equation 35), on a golden
    spiral, each with its mirrored direction.
    """
    u = (np.arange(samples) + 0.5) / samples
    phi = np.arange(samples) * np.pi * (3.0 - np.sqrt(5.0))
    alpha = roughness**2
    cos = np.sqrt((1.0 - u) / (1.0 + (alpha**2 - 1.0) * u))
    sin = np.sqrt(1.0 - cos**2)
    half = np.stack([sin * np.cos(phi), sin * np.sin(phi), cos], axis=-1)
    mirrored = 2.0 * half[:, 2:] * half - [0.0, 0.0, 1.0]
    return np.asarray(mirrored[mirrored[:, 2] > 0.0])


def basis(normal: Float64) -> Float64:
    """Rows: two tangents of a unit normal and itself, [3, 3]."""
    tangent = np.cross(np.eye(3)[int(np.argmin(np.abs(normal)))], normal)
    tangent /= np.linalg.norm(tangent)
    return np.stack([tangent, np.cross(normal, tangent), normal])


def harmonics(n: Float64) -> Float64:
    """Real spherical harmonics to order 2 of unit vectors [n, 3], [n, 9]; equation 3 there."""
    x, y, z = n.T
    return np.stack(
        [
            np.full(len(n), Y00), Y1 * y, Y1 * z, Y1 * x,
            Y2 * x * y, Y2 * y * z, Y20 * (3.0 * z * z - 1.0), Y2 * x * z, Y22 * (x * x - y * y),
        ],
        axis=-1,
    )  # fmt: skip

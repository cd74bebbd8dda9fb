"""Surfaces of a built-in scene and where they stand."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from lfd_render.scene.model import Image, Instance, Material, Mesh, TextureSlot
from lfd_render.scene.procedural.grid import Surface, tessellate
from lfd_render.scene.procedural.shapes import lathe

Matrix = NDArray[np.float64]


@dataclass
class Parts:
    """Surfaces and where they stand; built up part by part, then tessellated at once."""

    materials: Sequence[str]
    surfaces: list[Surface] = field(default_factory=list)
    places: list[list[Matrix]] = field(default_factory=list)

    def add(self, surface: Surface, *places: Matrix) -> None:
        """Put a surface at one or more places; no place means the world's origin."""
        self.surfaces.append(surface)
        self.places.append(list(places) or [np.eye(4)])

    def material(self, name: str) -> int:
        """The index of a material."""
        return self.materials.index(name)

    def instances(self) -> Iterator[Instance]:
        """All places in order."""
        for i, (surface, places) in enumerate(zip(self.surfaces, self.places, strict=True)):
            yield from (Instance(surface.name, i, place) for place in places)

    def meshes(self, triangles: int) -> list[Mesh]:
        """All surfaces with about so many triangles, counted over places."""
        return tessellate(self.surfaces, [len(p) for p in self.places], triangles)

    def turned(
        self,
        name: str,
        material: str,
        profile: list[tuple[float, float]],
        *,
        square: bool = False,
        flutes: int = 0,
        detail: float = 4.0,
        least: tuple[int, int] = (5, 4),
        tile: float = 0.8,
    ) -> Surface:
        """A lathe's surface with texture tiles of about `tile` metres that close round it."""
        radii, heights = np.array(profile).T
        around = 2 * np.pi * float(radii.max()) * (4 / np.pi if square else 1)
        down = float(np.hypot(np.diff(radii), np.diff(heights)).sum())
        return Surface(
            name,
            lathe(profile, square=square, flutes=flutes),
            (around, down),
            self.material(material),
            closed_u=True,
            poles=True,
            uv_scale=(max(1, round(around / tile)), max(1.0, down / tile)),
            detail=detail,
            least=least,
            corners=4 if square else 1,
        )


def at(
    x: float, y: float, z: float, yaw_deg: float = 0.0, *, tilt_deg: float = 0.0, size: float = 1.0
) -> Matrix:
    """`world_from_local` of a scale, a turn about +z by `tilt`, one about +y by `yaw`, a move."""
    yaw, tilt = np.eye(4), np.eye(4)
    angle = np.deg2rad(yaw_deg)
    yaw[0, 0] = yaw[2, 2] = np.cos(angle)
    yaw[0, 2], yaw[2, 0] = np.sin(angle), -np.sin(angle)
    angle = np.deg2rad(tilt_deg)
    tilt[0, 0] = tilt[1, 1] = np.cos(angle)
    tilt[0, 1], tilt[1, 0] = -np.sin(angle), np.sin(angle)
    matrix = yaw @ tilt
    matrix[:3, :3] *= size
    matrix[:3, 3] = (x, y, z)
    return matrix


def step(value: NDArray[np.float32], start: float, width: float) -> NDArray[np.float32]:
    """A smooth step from 0 to 1 that begins at `start`."""
    t = np.clip((value - np.float32(start)) / np.float32(width), 0.0, 1.0)
    smooth: NDArray[np.float32] = t * t * (3 - 2 * t)
    return smooth


def mapped(name: str, color: int, maps: int, **choices: object) -> Material:
    """A material of the images `color`, `maps` (its normals) and the one after (its ORM)."""
    return Material(
        name,
        base_color_texture=TextureSlot(color),
        normal_texture=TextureSlot(maps),
        occlusion_texture=TextureSlot(maps + 1),
        metallic_roughness_texture=TextureSlot(maps + 1),
        **choices,  # type: ignore[arg-type]  # fields of Material
    )


def triples(sets: Sequence[tuple[Image, Image, Image]]) -> tuple[Image, ...]:
    """The pictures of texture sets, one after another."""
    return tuple(image for triple in sets for image in triple)

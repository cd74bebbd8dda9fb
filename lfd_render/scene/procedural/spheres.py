"""`builtin:spheres`: nine spheres of metals and plastics at several depths in a photo studio."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..model import Image, Instance, Material, Scene, TextureSlot
from .grid import Surface, tessellate
from .shapes import sphere

# x, z, radius; name, linear base colour, metallic, roughness. Window height 2, centre y = 0.
_FLOOR_Y = -0.82
_BALLS = (
    (-0.02, 0.10, 0.40, "gold", (1.00, 0.71, 0.29), 1.0, 0.22),
    (-0.80, -0.18, 0.34, "red lacquer", (0.55, 0.02, 0.02), 0.0, 0.10),
    (0.80, -0.12, 0.36, "blue satin", (0.03, 0.12, 0.55), 0.0, 0.45),
    (-0.48, 0.42, 0.20, "chrome", (0.80, 0.81, 0.83), 1.0, 0.06),
    (0.46, 0.45, 0.19, "copper", (0.95, 0.54, 0.36), 1.0, 0.35),
    (0.03, 0.55, 0.11, "jade", (0.05, 0.38, 0.17), 0.0, 0.25),
    (-1.22, 0.20, 0.22, "brushed steel", (0.56, 0.57, 0.58), 1.0, 0.55),
    (1.25, 0.24, 0.21, "chalk", (0.80, 0.78, 0.74), 0.0, 0.95),
    (0.42, -0.62, 0.46, "violet", (0.24, 0.05, 0.42), 0.0, 0.30),
)


def spheres(triangles: int) -> Scene:
    """Nine spheres on a checkered ground that sweeps up into a backdrop.

    The window is 2 units high round the origin; spheres stand from 0.6 behind to 0.6 before it.
    """
    ground = Surface(
        name="ground",
        point=_sweep,
        size=(12.0, 9.0),
        material=len(_BALLS),
        uv_scale=(12.0, 9.0),
        detail=0.05,
        least=(4, 8),
    )
    balls = [
        Surface(
            name=name,
            point=sphere(radius),
            size=(2 * np.pi * radius, np.pi * radius),
            material=i,
            closed_u=True,
            poles=True,
            least=(8, 4),
        )
        for i, (_, _, radius, name, *_) in enumerate(_BALLS)
    ]
    surfaces = [*balls, ground]
    meshes = tessellate(surfaces, [1] * len(surfaces), triangles)
    places = [(x, _FLOOR_Y + radius, z) for x, z, radius, *_ in _BALLS] + [(0.0, 0.0, 0.0)]
    return Scene(
        name="spheres",
        meshes=tuple(meshes),
        instances=tuple(
            Instance(mesh.name, i, _translation(place))
            for i, (mesh, place) in enumerate(zip(meshes, places, strict=True))
        ),
        materials=(
            *(
                Material(name, (*color, 1.0), metallic, roughness)
                for _, _, _, name, color, metallic, roughness in _BALLS
            ),
            Material("ground", metallic=0.0, roughness=0.4, base_color_texture=TextureSlot(0)),
        ),
        images=(_checker(),),
        default_camera={
            "target": [0.0, 0.0, 0.0],
            "eye_direction": [0.0, 0.0, 1.0],
            "up": [0.0, 1.0, 0.0],
            "window_height": 2.0,
        },
    )


def _sweep(
    u: NDArray[np.float32], v: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """Backdrop from the top down, a quarter turn of radius 1.2, then floor toward the viewer."""
    radius, top, back = 1.2, 3.0, -2.4
    wall = top - radius
    bend = 0.5 * np.pi * radius
    length = 9.0
    s = v.astype(np.float64) * length
    angle = np.clip((s - wall) / radius, 0.0, 0.5 * np.pi)
    y = _FLOOR_Y + radius * (1.0 - np.sin(angle)) + np.maximum(wall - s, 0.0)
    z = back + radius * (1.0 - np.cos(angle)) + np.maximum(s - wall - bend, 0.0)
    x = (u - np.float32(0.5)) * np.float32(12.0)
    return x, y.astype(np.float32), z.astype(np.float32)


def _checker() -> Image:
    """Two by two warm grey fields, sRGB, with a hairline joint between them."""
    size = 512
    y, x = np.mgrid[0:size, 0:size]
    half = size // 2
    light = ((x // half) + (y // half)) % 2
    joint = (
        np.minimum(
            np.minimum(x % half, half - 1 - x % half), np.minimum(y % half, half - 1 - y % half)
        )
        < 3
    )
    grey = np.where(light == 1, 214, 96).astype(np.float64)
    grey[joint] = 60
    pixels = np.full((size, size, 4), 255, np.uint8)
    pixels[..., :3] = (grey[..., None] * np.array([1.0, 0.985, 0.955])).astype(np.uint8)
    return Image("ground checker", pixels)


def _translation(offset: tuple[float, float, float]) -> NDArray[np.float64]:
    matrix = np.eye(4)
    matrix[:3, 3] = offset
    return matrix

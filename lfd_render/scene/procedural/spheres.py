"""`builtin:spheres`: nine spheres of metals and plastics at several depths in a photo studio."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lfd_render.scene.model import Image, Instance, Material, Scene, TextureSlot
from lfd_render.scene.procedural.grid import Surface, tessellate
from lfd_render.scene.procedural.shapes import plane, sphere
from lfd_render.scene.procedural.textures import grid, mix, rgb, to_pixels

# x, z, radius; name, linear base colour, metallic, roughness.
_FLOOR_Y = -0.86
_BALLS = (
    (0.00, -0.10, 0.50, "gold", (1.00, 0.71, 0.29), 1.0, 0.22),
    (-0.93, -0.25, 0.42, "red lacquer", (0.50, 0.02, 0.02), 0.0, 0.10),
    (0.95, -0.20, 0.43, "blue satin", (0.03, 0.12, 0.50), 0.0, 0.45),
    (-0.50, 0.24, 0.23, "chrome", (0.80, 0.81, 0.83), 1.0, 0.06),
    (0.52, 0.26, 0.21, "copper", (0.95, 0.54, 0.36), 1.0, 0.35),
    (0.06, 0.42, 0.13, "jade", (0.05, 0.36, 0.16), 0.0, 0.25),
    (-1.30, 0.22, 0.21, "brushed steel", (0.56, 0.57, 0.58), 1.0, 0.55),
    (1.34, 0.20, 0.22, "chalk", (0.80, 0.78, 0.74), 0.0, 0.95),
    (0.50, -0.95, 0.70, "violet", (0.20, 0.05, 0.36), 0.0, 0.30),
)
_GROUND, _BACKDROP = len(_BALLS), len(_BALLS) + 1
_EDGE_Z = -1.75  # where the ground's checks end and the backdrop begins
_BEND = 1.2  # radius of the backdrop's sweep from floor to wall


def spheres(triangles: int) -> Scene:
    """Nine spheres on a checkered ground before a backdrop.

    The window is 2 units high round the origin; it cuts through the gold sphere.
    """
    half, depth = 6.0, 6.0
    floor = plane((-half, _FLOOR_Y, _EDGE_Z), (2 * half, 0, 0), (0, 0, depth))
    scale = (1.25 * half, 0.625 * depth)  # a tile of four fields is 1.6 units wide
    studio = [
        Surface("ground", floor, (2 * half, depth), _GROUND, uv_scale=scale, detail=0.1),
        Surface("backdrop", _sweep, (2 * half, 6.0), _BACKDROP, detail=0.05, least=(2, 6)),
    ]
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
    surfaces = [*balls, *studio]
    meshes = tessellate(surfaces, [1] * len(surfaces), triangles)
    places = [(x, _FLOOR_Y + radius, z) for x, z, radius, *_ in _BALLS] + [(0.0, 0.0, 0.0)] * 2
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
            Material("ground", metallic=0.0, roughness=0.35, base_color_texture=TextureSlot(0)),
            Material(
                "backdrop",
                metallic=0.0,
                roughness=0.9,
                base_color_texture=TextureSlot(1, wrap=("clamp", "clamp")),
            ),
        ),
        images=(_checker(), _gradient()),
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
    """The backdrop from its top down, then a quarter turn that meets the ground."""
    wall, bend = 3.0, 0.5 * np.pi * _BEND
    s = v.astype(np.float64) * (wall + bend)
    angle = np.maximum(s - wall, 0.0) / _BEND
    y = _FLOOR_Y + _BEND * (1.0 - np.sin(angle)) + np.maximum(wall - s, 0.0)
    z = _EDGE_Z - _BEND * np.cos(angle)
    x = (u - np.float32(0.5)) * np.float32(12.0)
    return x, y.astype(np.float32), z.astype(np.float32)


def _gradient() -> Image:
    """Backdrop paper, sRGB: a pool of light behind the spheres on slate blue."""
    u, v = grid(256)
    light = np.exp(-(((u - 0.5) / 0.16) ** 2) - ((v - 0.72) / 0.22) ** 2).astype(np.float32)
    return Image("backdrop", to_pixels(mix(rgb("26303d"), rgb("a9b4bd"), light)))


def _checker() -> Image:
    """Two by two fields of light and dark warm grey, sRGB, with a joint between them."""
    u, v = grid(512)
    across, down = 2 * u, 2 * v
    light = ((across.astype(np.int32) + down.astype(np.int32)) % 2).astype(np.float32)
    edge = np.minimum(np.minimum(across % 1, 1 - across % 1), np.minimum(down % 1, 1 - down % 1))
    joint = ((np.float32(0.016) - edge) * 256).astype(np.float32)
    color = mix(mix(rgb("605f5c"), rgb("d6d3cc"), light), rgb("3c3b39"), joint)
    return Image("ground checker", to_pixels(color))


def _translation(offset: tuple[float, float, float]) -> NDArray[np.float64]:
    matrix = np.eye(4)
    matrix[:3, 3] = offset
    return matrix

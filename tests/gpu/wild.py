"""Random scenes of everything at once: all that materials, textures, placements and bad triangles
can be, for tests that hold every pass to the reference."""

import dataclasses

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import DisplayProfile
from lfd_render.scene import Image, Instance, Light, Material, Scene, TextureSlot

from .helpers import mesh_of, placement, soup

# Of each picture, so that all scenes compile to the same shaders.
_WRAPS = (("repeat", "clamp"), ("mirror", "repeat"), ("clamp", "mirror"), ("repeat", "repeat"))


def wild_scene(rng: np.random.Generator, profile: DisplayProfile, count: int) -> Scene:
    """So many triangles of each kind of material, some without area in space or in texture
    coordinates, standing once as they are and once mirrored; half of the scenes have lights."""
    images = tuple(_picture(rng, *size) for size in ((16, 16), (32, 8), (4, 8), (1, 1)))
    materials = (
        Material("plain", (0.8, 0.5, 0.3, 1.0), metallic=0.2, roughness=0.6),
        _full(rng, "full, one side"),
        dataclasses.replace(_full(rng, "full"), double_sided=True),
        Material(
            "mask", roughness=0.7, metallic=0.0, alpha_mode="mask", alpha_cutoff=0.5,
            base_color_texture=_slot(rng), normal_texture=_slot(rng, scale=0.5),
        ),
        Material(
            "glass", (0.3, 0.9, 0.4, 0.5), alpha_mode="blend", double_sided=True, metallic=0.0,
            roughness=0.5, base_color_texture=_slot(rng),
        ),
        Material("unlit", unlit=True, double_sided=True, base_color_texture=_slot(rng)),
    )  # fmt: skip
    meshes, instances = [], []
    for index in range(len(materials)):
        corners = spoilt(rng, soup(rng, count, profile))
        normals = np.array([0.0, 0.0, 1.0]) + 0.5 * rng.normal(size=(count, 3, 3))
        meshes.append(
            mesh_of(
                corners,
                index,
                normals=normals / np.linalg.norm(normals, axis=-1, keepdims=True),
                texcoords=_coordinates(rng, count),
                colors=rng.uniform(0.5, 1.0, (count, 3, 4)),
            )
        )
        for mirrored in (False, True):
            name = f"{materials[index].name}, {mirrored}"
            instances.append(Instance(name, index, placement(rng, mirrored=mirrored)))
    lights = _lights(rng, profile) if rng.random() < 0.5 else ()
    return Scene("wild", tuple(meshes), tuple(instances), materials, images, lights=lights)


def spoilt(rng: np.random.Generator, corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Triangles [triangle, corner, xyz], a tenth of them of one point, of two or on a line."""
    kind = rng.integers(0, 30, len(corners))
    corners[kind == 0] = corners[kind == 0][:, :1]
    corners[kind == 1, 2] = corners[kind == 1, 1]
    on_line = kind == 2
    corners[on_line] = np.rint(corners[on_line])  # so that the middle of a side is on it, exactly
    corners[on_line, 1] = 0.5 * (corners[on_line, 0] + corners[on_line, 2])
    return corners


def _coordinates(rng: np.random.Generator, count: int) -> NDArray[np.float64]:
    """Texture coordinates [triangle, corner, set, uv], a fifth of them without area in a set."""
    found = rng.uniform(-1.0, 2.0, (count, 3, 2, 2))
    kind = rng.integers(0, 20, (count, 2))
    for texcoord in (0, 1):
        point, line = kind[:, texcoord] <= 1, (kind[:, texcoord] > 1) & (kind[:, texcoord] <= 3)
        found[point, :, texcoord] = found[point, :1, texcoord]
        found[line, :, texcoord, 1] = found[line, :1, texcoord, 1]
    return found


def _picture(rng: np.random.Generator, width: int, height: int) -> Image:
    """Texels that change slowly, so that what is not linear in them is filtered alike; alpha runs
    from clear to opaque."""
    y, x = np.mgrid[:height, :width] / np.array([height, width])[:, None, None] * 2.0 * np.pi
    waves = [np.sin(x + a) * np.cos(y + b) for a, b in rng.uniform(0.0, 6.0, (4, 2))]
    texels = (127.5, 180.0, 207.5, 127.5) + np.stack(waves, axis=-1) * (50.0, 40.0, 30.0, 120.0)
    return Image(f"{width} × {height}", np.rint(texels).clip(0, 255).astype(np.uint8))


def _slot(rng: np.random.Generator, scale: float = 1.0) -> TextureSlot:
    turn = None
    if rng.random() < 0.5:
        turn = np.eye(3)
        turn[:2] = rng.normal(size=(2, 3))
    image = int(rng.integers(len(_WRAPS)))
    return TextureSlot(image, int(rng.integers(2)), _WRAPS[image], scale, turn)  # type: ignore[arg-type]  # names of WRAPS


def _full(rng: np.random.Generator, name: str) -> Material:
    return Material(
        name,
        (0.9, 0.8, 0.7, 1.0),
        metallic=float(rng.uniform()),
        roughness=float(rng.uniform(0.6, 1.0)),
        emissive=(0.2, 0.5, 1.5),
        base_color_texture=_slot(rng),
        metallic_roughness_texture=_slot(rng),
        normal_texture=_slot(rng, scale=0.4),
        occlusion_texture=_slot(rng, scale=0.7),
        emissive_texture=_slot(rng),
    )


def _lights(rng: np.random.Generator, profile: DisplayProfile) -> tuple[Light, ...]:
    """One of each kind, before the panel, toward it."""
    distance = profile.distance_mm
    lights = []
    for kind in ("directional", "point", "spot"):
        matrix = np.eye(4)
        matrix[:3, 3] = (*rng.uniform(-0.3, 0.3, 2) * distance, rng.uniform(0.9, 1.2) * distance)
        power = 1.0 if kind == "directional" else distance**2
        lights.append(Light(kind, kind, matrix, (1.0, 0.9, 0.8), power, outer_cone_rad=1.0))  # type: ignore[arg-type]
    return tuple(lights)

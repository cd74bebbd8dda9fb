"""A scene that every rule for levels of detail renders differently."""

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import Camera, DisplayProfile
from lfd_render.scene import Image, Instance, Material, Scene, TextureSlot
from lfd_render.scene.procedural.grid import Surface, tessellate
from lfd_render.scene.procedural.lettering import lettering
from lfd_render.scene.procedural.shapes import plane
from lfd_render.scene.procedural.textures import to_pixels

Pixels = NDArray[np.uint8]
_INK, _PAPER = 0.1, 0.88  # sRGB; paper is 0.75 in linear light, below the tone curve's shoulder


def corridor(width: float, height: float) -> Scene:
    """Floor, ceiling, walls and an end of fine black-and-white pictures behind a window of that
    size, four windows' heights deep, all unlit."""
    depth = 4.0 * height
    w, h = 0.5 * width, 0.5 * height
    tile = 0.5 * height  # side of a picture's first repeat on the floor
    surfaces = [
        Surface("floor", plane((-w, -h, -depth), (width, 0, 0), (0, 0, depth)), (1, 1), 0),
        Surface("ceiling", plane((-w, h, 0), (width, 0, 0), (0, 0, -depth)), (1, 1), 1),
        Surface("left", plane((-w, h, 0), (0, 0, -depth), (0, -height, 0)), (1, 1), 2),
        Surface("right", plane((w, h, -depth), (0, 0, depth), (0, -height, 0)), (1, 1), 3),
        Surface("end", plane((-w, h, -depth), (width, 0, 0), (0, -height, 0)), (1, 1), 4),
    ]
    images = [
        Image("checker", _checker(512, 512, 16)),
        Image("squares", _checker(64, 256, 4)),
        Image("lettering", _lettered(1024, 128)),
        Image("lines", _lines(128, 512)),
        Image("end", _lettered(256, 256)),
    ]
    # Repeats along u and v; each is a surface's length over a picture's.
    repeats = [
        (0.5 * width / tile, 0.5 * depth / tile),
        (width / tile, 2.0 * depth / tile),
        (0.5 * depth / tile, 2.0),
        (depth / tile, 2.0),
        (2.0 * width / tile, 4.0),
    ]
    turns = [0.0, 0.35, 0.0, 0.6, 0.0]
    materials = tuple(
        Material(
            image.name,
            unlit=True,
            base_color_texture=TextureSlot(index, uv_transform=_placed(*repeat, turn)),
        )
        for index, (image, repeat, turn) in enumerate(zip(images, repeats, turns, strict=True))
    )
    meshes = tessellate(surfaces, [1] * len(surfaces), 2 * len(surfaces))
    instances = tuple(Instance(mesh.name, i, np.eye(4)) for i, mesh in enumerate(meshes))
    return Scene("corridor", tuple(meshes), instances, materials, tuple(images))


def _placed(u: float, v: float, turn_rad: float) -> NDArray[np.float64]:
    """Texture transform [3, 3]: so many repeats, then turned."""
    cos, sin = np.cos(turn_rad), np.sin(turn_rad)
    matrix = np.eye(3)
    matrix[:2, :2] = np.array([[cos, sin], [-sin, cos]]) @ np.diag([u, v])
    return matrix


def _painted(ink: NDArray[np.bool_]) -> Pixels:
    grey = np.where(ink, _INK, _PAPER)
    return to_pixels((grey, grey, grey))


def _checker(width: int, height: int, square: int) -> Pixels:
    y, x = np.mgrid[:height, :width] // square
    return _painted((x + y) % 2 == 1)


def _lines(width: int, height: int) -> Pixels:
    """Thin upright lines, a heavy one every eighth, and a level one."""
    y, x = np.mgrid[:height, :width]
    return _painted((x % 8 < 2) | (x % 64 < 6) | (y % 64 < 6))


def _lettered(width: int, height: int) -> Pixels:
    """Lines of figures 14 texels high."""
    ink = np.zeros((height, width), bool)
    for line, top in enumerate(range(4, height - 14, 20)):
        text = "".join(str((7 * line + 3 * k) % 10) for k in range(width // 12))
        row = lettering(text, 2)[:, : width - 4]
        ink[top : top + row.shape[0], 2 : 2 + row.shape[1]] = row
    return _painted(ink)


def in_front_of(display: DisplayProfile) -> Camera:
    """The window in its own millimetres."""
    return Camera((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), display.size_mm[1])

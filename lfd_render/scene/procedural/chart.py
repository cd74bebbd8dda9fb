"""`builtin:chart`: resolution and depth charts at known distances from the window plane.

Lengths are in window heights: the default camera makes the window 1 high round the origin, so
a card at z = +0.1 stands a tenth of the window's height before the panel. Everything is unlit:
what a view shows is the texture's own colour.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lfd_render.scene.model import Image, Instance, Material, Scene, TextureSlot
from lfd_render.scene.procedural.grid import Surface, tessellate
from lfd_render.scene.procedural.lettering import lettering
from lfd_render.scene.procedural.shapes import plane
from lfd_render.scene.procedural.textures import Field, grid, to_pixels

# x, y, z of the cards' centres; the middle one is the focus card on the window plane.
CARDS = (
    (-0.56, 0.32, -0.25),
    (0.0, 0.345, -0.10),
    (0.56, 0.32, 0.25),
    (-0.56, 0.0, -0.15),
    (0.0, 0.0, 0.0),
    (0.56, 0.0, 0.15),
    (-0.56, -0.32, -0.05),
    (0.0, -0.345, 0.10),
    (0.56, -0.32, 0.05),
)
BACKDROP_Z = -0.4
_CARD, _FOCUS_CARD = 0.25, 0.36  # side lengths
_CARD_TEXELS, _RULER_TEXELS = 512, (1024, 128)
_PAPER, _INK = np.float32(0.93), np.float32(0.05)
_STAR_SPOKES = 36
_RULER_REACH = 0.3  # the slanted rulers run from this far behind to this far before the window


def chart(triangles: int) -> Scene:
    """Nine cards with a Siemens star, line pairs and their depth, two slanted rulers, a backdrop.

    Line pairs are 2, 4, 8, 16 and 32 texels wide, upright and level; the star has 36 spokes. The
    rulers have a line every 0.05 of depth.
    """
    surfaces = [_card(i) for i in range(len(CARDS))]
    surfaces += [_ruler(x, len(CARDS)) for x in (-0.285, 0.285)]
    surfaces.append(_backdrop(len(CARDS) + 1))
    images = [Image(f"card {z:+.2f}", _card_pixels(f"{z:+.2f}")) for _, _, z in CARDS]
    images += [Image("ruler", _ruler_pixels()), Image("backdrop", _backdrop_pixels())]
    meshes = tessellate(surfaces, [1] * len(surfaces), triangles)
    return Scene(
        name="chart",
        meshes=tuple(meshes),
        instances=tuple(Instance(m.name, i, np.eye(4)) for i, m in enumerate(meshes)),
        materials=tuple(
            Material(
                image.name,
                metallic=0.0,
                double_sided=True,
                unlit=True,
                base_color_texture=TextureSlot(i),
            )
            for i, image in enumerate(images)
        ),
        images=tuple(images),
        default_camera={
            "target": [0.0, 0.0, 0.0],
            "eye_direction": [0.0, 0.0, 1.0],
            "up": [0.0, 1.0, 0.0],
            "window_height": 1.0,
        },
    )


def _card(index: int) -> Surface:
    x, y, z = CARDS[index]
    side = _FOCUS_CARD if z == 0.0 else _CARD
    corner = (x - side / 2, y + side / 2, z)
    point = plane(corner, (side, 0, 0), (0, -side, 0))
    return Surface(f"card {z:+.2f}", point, (side, side), index)


def _ruler(x: float, material: int) -> Surface:
    """A strip that slants from the top behind the window to the bottom before it."""
    width, reach = 0.08, _RULER_REACH
    point = plane((x - width / 2, 0.46, -reach), (width, 0, 0), (0, -0.92, 2 * reach))
    return Surface(f"ruler {x:+.3f}", point, (width, 1.1), material)


def _backdrop(material: int) -> Surface:
    half = (3.0, 2.0)
    corner = (-half[0], half[1], BACKDROP_Z)
    point = plane(corner, (2 * half[0], 0, 0), (0, -2 * half[1], 0))
    return Surface(
        "backdrop",
        point,
        (2 * half[0], 2 * half[1]),
        material,
        uv_scale=(20 * half[0], 20 * half[1]),
        detail=0.25,
    )


def _siemens_star(size: int) -> Field:
    """Spokes [size, size]: 0 ink to 1 paper, edges smoothed over a texel, paper outside."""
    u, v = grid(size)
    x, y = (u - np.float32(0.5)) * size, (v - np.float32(0.5)) * size
    radius = np.hypot(x, y)
    angle = np.arctan2(y, x)
    # A spoke's edge is where the sine crosses 0; its slope turns the sine into texels.
    wave = np.sin(angle * _STAR_SPOKES) * radius / np.float32(_STAR_SPOKES)
    spokes = np.clip(wave + np.float32(0.5), 0.0, 1.0)
    inside = np.clip(np.float32(size / 2 - 1) - radius, 0.0, 1.0)
    star: Field = (spokes * inside + (1 - inside)).astype(np.float32)
    return star


def _card_pixels(label: str) -> NDArray[np.uint8]:
    """Star in the upper left, line pairs to its right, the depth's figure and bars beneath."""
    size = _CARD_TEXELS
    paper = np.ones((size, size), np.float32)
    star = 344
    paper[20 : 20 + star, 20 : 20 + star] = _siemens_star(star)
    _line_pairs(paper)
    ink = lettering(label, 8)
    paper[392 : 392 + ink.shape[0], 20 : 20 + ink.shape[1]][ink] = 0.0
    border = 6
    paper[:border], paper[-border:], paper[:, :border], paper[:, -border:] = 0.0, 0.0, 0.0, 0.0
    return _grey(paper)


def _line_pairs(paper: Field) -> None:
    """Blocks of upright (right column) and level (bottom row) lines, periods of 2 to 32 texels."""
    texels = np.arange(100)
    for i, period in enumerate((2, 4, 8, 16, 32)):
        stripes = (texels % period < (period + 1) // 2).astype(np.float32)
        top = 20 + i * 70
        paper[top : top + 62, 388:488] = 1.0 - stripes[None, :]
        if period > 2:
            left = 280 + (i - 1) * 54
            paper[392:492, left : left + 46] = 1.0 - stripes[:, None]


def _ruler_pixels() -> NDArray[np.uint8]:
    """A line every 0.05 of depth, longer every 0.1, longest at the window plane."""
    height, width = _RULER_TEXELS
    paper = np.ones((height, width), np.float32)
    steps = round(2 * _RULER_REACH / 0.05)
    for i in range(steps + 1):
        row = round(i / steps * (height - 1))
        length = width if 2 * i == steps else width // 2 if i % 2 == 0 else width // 4
        paper[max(row - 3, 0) : row + 3, :length] = 0.0
        if i % 2 == 0 and 0 < i < steps:
            depth = -_RULER_REACH + i * 0.05
            ink = lettering(f"{abs(depth):.1f}"[1:], 5)
            paper[row + 8 : row + 8 + ink.shape[0], 70 : 70 + ink.shape[1]][ink] = 0.0
    return _grey(paper)


def _backdrop_pixels() -> NDArray[np.uint8]:
    """One field of a dark grid, 0.1 window heights wide."""
    size = 64
    field = np.full((size, size), 0.22, np.float32)
    field[:2], field[:, :2] = 0.45, 0.45
    return _grey(field)


def _grey(paper: Field) -> NDArray[np.uint8]:
    """0 ink to 1 paper as sRGB pixels."""
    value = _INK + (_PAPER - _INK) * paper
    return to_pixels((value, value, value))

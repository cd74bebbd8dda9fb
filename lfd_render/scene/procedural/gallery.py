"""`builtin:gallery`: a museum hall that fills the view, with four texture maps on every surface.

Metres. The window is 3 m high and stands in the middle of the hall, a closed room whose walls
face inwards: each ray through the window crosses the room and so meets a wall, from any eye and
at any yaw. Statues stand before and behind the window. Depth is squeezed to 0.55, which leaves
neighbouring views at most about two columns apart on a 27-inch display with a 40° cone.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from lfd_render.scene.model import Image, Material, Scene, TextureSlot
from lfd_render.scene.procedural import materials as paint
from lfd_render.scene.procedural.grid import Surface, SurfaceMap
from lfd_render.scene.procedural.parts import Matrix, Parts, at, mapped, step, triples
from lfd_render.scene.procedural.shapes import frame, plane, rounded, sphere, torus_knot
from lfd_render.scene.procedural.textures import TextureSet, mosaic, to_pixels

_HALF_WIDTH, _FLOOR, _CEILING, _BACK, _FRONT = 4.4, -1.4, 1.58, -3.25, 3.25
_HEIGHT = _CEILING - _FLOOR
_OVERLAP = 0.05
_LARGEST_SET, _BESIDE_MOSAICS = 4096, 2048  # texels a side
_STAND = _FLOOR - 0.01  # things sink in a little, so that no two faces coincide

_SETS: dict[str, Callable[[int], TextureSet]] = {
    "floor": paint.floor_tiles,
    "damask": paint.damask,
    "plaster": paint.plaster,
    "marble": paint.marble,
    "granite": paint.granite,
    "bronze": paint.bronze,
    "gilt": paint.gilt,
    "lamp": paint.lamp_glass,
}
_PAINTINGS = (
    (5, "35507a", "f0b46a", ("6d7f93", "4c6470", "2f4a48", "1b2f2a")),
    (8, "88b4d8", "f4e6c4", ("9fb2a8", "6f9a72", "3f7040", "274c2a")),
    (12, "2a2350", "d8618a", ("6a4a80", "483468", "2c2148", "171230")),
    (17, "d9c9a0", "f3f0e2", ("c0a070", "a87848", "7c5030", "50301c")),
)
_MATERIALS = (*_SETS, *(f"painting {i + 1}" for i in range(len(_PAINTINGS))))


def gallery(triangles: int, textures: int) -> Scene:
    """The hall with about `triangles` triangles and maps of `textures`² texels.

    Above 4096 only the floor's are that large, a mosaic of slabs of which no two are alike, and
    the others are of 2048² texels.
    """
    hall = Parts(_MATERIALS)
    blocks = max(1, textures // _LARGEST_SET)
    _add_room(hall, blocks)
    _add_columns(hall)
    _add_sculptures(hall)
    _add_pictures(hall)
    _add_lamps(hall)
    meshes = hall.meshes(triangles)
    materials, images = _materials(textures // blocks, blocks)
    return Scene(
        name="gallery",
        meshes=tuple(meshes),
        instances=tuple(hall.instances()),
        materials=materials,
        images=images,
        default_camera={
            "target": [0.0, 0.0, 0.0],
            "eye_direction": [0.0, 0.0, 1.0],
            "up": [0.0, 1.0, 0.0],
            "window_height": 3.0,
            "depth_scale": 0.55,
        },
    )


def _add_room(hall: Parts, blocks: int) -> None:
    # Each surface reaches a little beyond the next, so that no gap opens along their edges.
    w, low, high = _HALF_WIDTH + _OVERLAP, _FLOOR - _OVERLAP, _CEILING + _OVERLAP
    back, front = _BACK - _OVERLAP, _FRONT + _OVERLAP
    d, h = front - back, high - low
    floor = plane((-w, _FLOOR, back), (2 * w, 0, 0), (0, 0, d))
    hall.add(_wall("floor", "floor", floor, (2 * w, d), 2.0 * blocks))
    ceiling = plane((-w, _CEILING, front), (2 * w, 0, 0), (0, 0, -d), _coffers)
    hall.add(_wall("ceiling", "plaster", ceiling, (2 * w, d), 2.0, detail=1.5))
    far = plane((-w, high, _BACK), (2 * w, 0, 0), (0, -h, 0), _niche)
    hall.add(_wall("back wall", "damask", far, (2 * w, h), 1.6, detail=2.0))
    left = plane((-_HALF_WIDTH, high, front), (0, 0, -d), (0, -h, 0), _panels)
    hall.add(_wall("left wall", "damask", left, (d, h), 1.6))
    right = plane((_HALF_WIDTH, high, back), (0, 0, d), (0, -h, 0), _panels)
    hall.add(_wall("right wall", "damask", right, (d, h), 1.6))
    near = plane((w, high, _FRONT), (-2 * w, 0, 0), (0, -h, 0), _panels)
    hall.add(_wall("front wall", "damask", near, (2 * w, h), 1.6, detail=0.2))


def _wall(
    name: str,
    material: str,
    point: SurfaceMap,
    size: tuple[float, float],
    tile: float,
    *,
    detail: float = 1.0,
) -> Surface:
    """An open surface of the room whose texture repeats every `tile` metres."""
    return Surface(
        name,
        point,
        size,
        _MATERIALS.index(material),
        uv_scale=(size[0] / tile, size[1] / tile),
        detail=detail,
    )


def _coffers(u: NDArray[np.float32], v: NDArray[np.float32]) -> NDArray[np.float32]:
    """Beams 0.17 m deep round recessed fields, 6 across and 4 along the hall."""
    across = np.abs((u * 6) % 1 - np.float32(0.5))
    along = np.abs((v * 4) % 1 - np.float32(0.5))
    edge = np.maximum(across, along)
    beams = np.float32(0.12) * step(edge, 0.34, 0.04)
    relief: NDArray[np.float32] = beams + np.float32(0.05) * step(edge, 0.26, 0.03)
    return relief


def _wainscot(v: NDArray[np.float32]) -> NDArray[np.float32]:
    """Skirting, dado rail and cornice, in metres from the wall; v runs down its height."""
    y = v * np.float32(_HEIGHT + 2 * _OVERLAP) - np.float32(_OVERLAP)
    cornice = np.float32(0.16) * (1 - step(y, 0.10, 0.14))
    rail = np.float32(0.05) * step(y, 2.10, 0.03) * (1 - step(y, 2.19, 0.04))
    skirting = np.float32(0.06) * step(y, 2.76, 0.05)
    relief: NDArray[np.float32] = cornice + rail + skirting
    return relief


def _panels(u: NDArray[np.float32], v: NDArray[np.float32]) -> NDArray[np.float32]:
    """Raised panel mouldings, five along the wall, under the cornice and over the rail."""
    x = np.abs((u * 5) % 1 - np.float32(0.5)) * np.float32(2.0)
    y = np.abs(v - np.float32(0.40)) * np.float32(2.0)
    edge = np.maximum(np.float32(0.44) - np.abs(x - np.float32(0.41)) - np.float32(0.40), 0)
    side = edge * (y < 0.62)
    bar = np.maximum(np.float32(0.04) - np.abs(y - np.float32(0.60)), 0) * (x < 0.44)
    relief: NDArray[np.float32] = _wainscot(v) + np.minimum(np.maximum(side, bar), 0.03)
    return relief


def _niche(u: NDArray[np.float32], v: NDArray[np.float32]) -> NDArray[np.float32]:
    """A half-round arched niche, 0.7 m deep over a sill, in the middle of the wall."""
    x = (u - np.float32(0.5)) * np.float32(2 * (_HALF_WIDTH + _OVERLAP))
    y = np.float32(_CEILING + _OVERLAP) - v * np.float32(_HEIGHT + 2 * _OVERLAP)
    above = np.maximum(y - np.float32(0.28), 0.0)
    radius = np.hypot(x, above)
    hollow = np.float32(0.7) * np.sqrt(np.clip(1 - (radius / np.float32(0.85)) ** 2, 0.0, 1.0))
    hollow *= step(y, -1.12, 0.04)
    rim = np.float32(0.06) * (step(radius, 0.85, 0.03) - step(radius, 0.98, 0.05))
    relief: NDArray[np.float32] = _wainscot(v) * step(radius, 0.85, 0.02) + rim - hollow
    return relief


def _add_columns(hall: Parts) -> None:
    top = _HEIGHT + 0.03
    profile = [
        (0.0, top), (0.36, top), (0.36, top - 0.11), (0.29, top - 0.18), (0.26, top - 0.28),
        (0.21, top - 0.31), (0.25, 0.36), (0.32, 0.29), (0.28, 0.22), (0.36, 0.14),
        (0.36, 0.0), (0.0, 0.0),
    ]  # fmt: skip
    column = hall.turned("column", "marble", profile, flutes=20, least=(4, 4), detail=3.0)
    spots = ((3.1, -2.5), (3.05, -0.8), (3.65, 2.4))
    places = [at(side * x, _STAND, z) for x, z in spots for side in (-1, 1)]
    hall.add(column, *places)


def _plinth(hall: Parts, height: float, half: float, *places: Matrix) -> None:
    profile = [
        (0.0, height), (half, height), (half, height - 0.06), (0.85 * half, height - 0.10),
        (0.80 * half, 0.16), (half, 0.10), (half, 0.0), (0.0, 0.0),
    ]  # fmt: skip
    hall.add(hall.turned("plinth", "granite", profile, square=True, least=(4, 3)), *places)


def _add_sculptures(hall: Parts) -> None:
    _plinth(hall, 0.72, 0.33, at(-1.35, _STAND, 0.70, 20), at(1.42, _STAND, 0.35, -15))
    hall.add(_knot("bronze knot", "bronze", (2, 3), 0.46, 0.13), at(-1.35, -0.14, 0.70, 25))
    bumpy = _round("gilt planet", "gilt", 0.46, bumps=_bumps)
    hall.add(bumpy, at(1.42, -0.24, 0.35))
    _plinth(hall, 0.42, 0.42, at(0.0, _STAND, -0.95, 45))
    hall.add(_knot("great knot", "gilt", (3, 4), 0.54, 0.09), at(0.0, -0.37, -0.95, -20))
    _plinth(hall, 0.80, 0.28, at(-2.35, _STAND, -1.35), at(2.35, _STAND, -1.35))
    hall.add(_vase(hall), *(at(x, _STAND + 0.795, -1.35) for x in (-2.35, 2.35)))
    hall.add(_figure(hall), at(0.0, _STAND, _BACK - 0.15))


def _knot(
    name: str, material: str, winding: tuple[int, int], radius: float, tube: float
) -> Surface:
    # The curve turns `p` times at two thirds of the radius and swings `q` times inside the ring.
    along = 2 * np.pi * radius * float(np.hypot(winding[0] * 0.67, winding[1] * 0.33))
    return Surface(
        name,
        torus_knot(*winding, radius, tube),
        (along, 2 * np.pi * tube),
        _MATERIALS.index(material),
        closed_u=True,
        closed_v=True,
        uv_scale=(max(1, round(along / (2 * np.pi * tube))), 1.0),
        detail=6.0,
        least=(12, 3),
    )


def _round(
    name: str,
    material: str,
    radius: float,
    *,
    bumps: Callable[[NDArray[np.float32], NDArray[np.float32]], NDArray[np.float32]] | None = None,
    uv_scale: tuple[float, float] = (4.0, 2.0),
    least: tuple[int, int] = (6, 3),
) -> Surface:
    return Surface(
        name,
        sphere(radius, bumps),
        (2 * np.pi * radius, np.pi * radius),
        _MATERIALS.index(material),
        closed_u=True,
        poles=True,
        uv_scale=uv_scale,
        detail=6.0,
        least=least,
    )


def _bumps(u: NDArray[np.float32], v: NDArray[np.float32]) -> NDArray[np.float32]:
    """Knobs in rings that fade toward the poles."""
    turn = np.float32(2 * np.pi)
    knobs = np.cos(turn * 8 * u) * np.cos(turn * 5 * v) + 0.35 * np.cos(turn * (3 * u + 2 * v))
    faded: NDArray[np.float32] = 0.07 * knobs * np.sin(v * np.float32(np.pi)) ** 2
    return faded


def _vase(hall: Parts) -> Surface:
    profile = [
        (0.0, 0.72), (0.09, 0.72), (0.13, 0.76), (0.11, 0.68), (0.08, 0.58), (0.17, 0.48),
        (0.22, 0.38), (0.20, 0.26), (0.12, 0.12), (0.09, 0.06), (0.13, 0.0), (0.0, 0.0),
    ]  # fmt: skip
    return hall.turned("vase", "bronze", rounded(profile), detail=6.0)


def _figure(hall: Parts) -> Surface:
    """A turned marble figure on its own drum, for the niche."""
    profile = [
        (0.0, 2.29), (0.08, 2.26), (0.12, 2.18), (0.11, 2.07), (0.06, 2.00), (0.08, 1.95),
        (0.22, 1.90), (0.25, 1.78), (0.19, 1.52), (0.15, 1.38), (0.21, 1.12), (0.29, 0.78),
        (0.32, 0.73), (0.40, 0.70), (0.40, 0.08), (0.46, 0.0), (0.0, 0.0),
    ]  # fmt: skip
    return hall.turned("figure", "marble", rounded(profile))


def _add_pictures(hall: Parts) -> None:
    width, height, y = 1.16, 0.90, 0.30
    offset = 0.09  # clear of the wall's mouldings
    side = _HALF_WIDTH - offset
    places = [
        at(-1.92, y, _BACK + offset),
        at(1.92, y, _BACK + offset),
        at(-side, y, -1.5, 90),
        at(side, y, -1.5, -90),
        at(-side, y, 0.9, 90),
        at(side, y, 0.9, -90),
    ]
    rim = 0.12
    border = Surface(
        "picture frame",
        frame(width, height, rim, 0.09),
        (2 * (width + height + 4 * rim), 3.2 * rim),
        _MATERIALS.index("gilt"),
        closed_u=True,
        closed_v=True,
        uv_scale=(16.0, 1.0),
        detail=6.0,
        least=(4, 3),
        corners=4,
    )
    hall.add(border, *places)
    for i in range(len(_PAINTINGS)):
        corner = (-width / 2, height / 2, 0.02)
        canvas = plane(corner, (width, 0, 0), (0, -height, 0))
        name = f"painting {i + 1}"
        surface = Surface(name, canvas, (width, height), _MATERIALS.index(name), detail=0.5)
        hall.add(surface, *places[i :: len(_PAINTINGS)])


def _add_lamps(hall: Parts) -> None:
    spots = [(-1.75, -0.6), (1.75, -0.6), (-0.62, -1.9), (0.62, -1.9)]
    globe = _round("lamp", "lamp", 0.15, uv_scale=(1.0, 1.0), least=(5, 3))
    hall.add(globe, *(at(x, 0.94, z) for x, z in spots))
    rod = [(0.0, 0.62), (0.10, 0.61), (0.012, 0.55), (0.012, 0.06), (0.05, 0.0), (0.0, 0.0)]
    surface = hall.turned("lamp rod", "gilt", rod, detail=8.0, least=(3, 3), tile=0.3)
    hall.add(surface, *(at(x, 1.05, z) for x, z in spots))


def _materials(size: int, blocks: int) -> tuple[tuple[Material, ...], tuple[Image, ...]]:
    """Materials in the order of their names, and their pictures, made on two threads.

    size: texels a side of a block, of which the floor has `blocks` each way.
    """
    beside = size if blocks == 1 else _BESIDE_MOSAICS

    def make(name: str) -> tuple[Image, Image, Image]:
        if name == "floor":
            return mosaic(lambda seed: paint.floor_tiles(size, seed).images(), blocks)
        return (_SETS | {"canvas": paint.canvas})[name](beside).images()

    with ThreadPoolExecutor(2) as pool:
        sets = list(pool.map(make, (*_SETS, "canvas")))
        pictures = list(pool.map(lambda p: to_pixels(paint.painting(beside, *p)), _PAINTINGS))
    images = list(triples(sets[:-1]))
    materials = [_material(name, 3 * i, 3 * i + 1) for i, name in enumerate(_SETS)]
    weave = len(images)  # the canvas's own colour is not used
    images += sets[-1][1:]
    for name, pixels in zip(_MATERIALS[len(_SETS) :], pictures, strict=True):
        materials.append(_material(name, len(images), weave))
        images.append(Image(name, pixels))
    return tuple(materials), tuple(images)


def _material(name: str, color: int, maps: int) -> Material:
    if name != "lamp":
        return mapped(name, color, maps)
    return mapped(name, color, maps, emissive=(6.0, 5.0, 3.4), emissive_texture=TextureSlot(color))

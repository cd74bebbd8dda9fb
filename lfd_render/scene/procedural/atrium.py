"""`builtin:atrium`: an arcaded court that fills the view, after the kind of the Sponza palace.

Metres. As in the gallery, walls face inwards and close the room, so each ray through the window
meets one from any eye and at any yaw. Two storeys of arches run along both sides; behind them
aisles and galleries hide much of what is drawn. Depth is squeezed to 0.4.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from lfd_render.scene.model import Scene, TextureSlot
from lfd_render.scene.procedural import materials as paint
from lfd_render.scene.procedural.grid import Surface, SurfaceMap
from lfd_render.scene.procedural.parts import Parts, at, mapped, step, triples
from lfd_render.scene.procedural.shapes import plane, rounded, sphere
from lfd_render.scene.procedural.textures import TextureSet

_FLOOR, _SLAB, _TOP, _CREST = -1.5, 0.42, 1.85, 2.75
_NAVE, _AISLE, _BACK, _FRONT = 2.35, 3.9, -7.25, 3.25
_BAY, _BAYS, _THICK = 1.5, 7, 0.3
_OVERLAP = 0.05
_LOW_SPRING, _HIGH_SPRING = -0.45, 1.05

_SETS: dict[str, Callable[[int], TextureSet]] = {
    "flagstones": paint.floor_tiles,
    "ashlar": paint.ashlar,
    "brick": paint.brick,
    "plaster": paint.plaster,
    "marble": paint.marble,
    "bronze": paint.bronze,
    "gilt": paint.gilt,
    "lamp": paint.lamp_glass,
    "red cloth": lambda size: paint.cloth(size, 91, "7c1420", "d2a648"),
    "green cloth": lambda size: paint.cloth(size, 94, "1d4a30", "c9b878"),
    "blue cloth": lambda size: paint.cloth(size, 97, "1c3366", "cfc9b4"),
}


def atrium(triangles: int, textures: int) -> Scene:
    """The court with about `triangles` triangles and maps of `textures`² texels."""
    court = Parts(tuple(_SETS))
    _add_shell(court)
    for side in (-1, 1):
        _add_arcade(court, side, spring=_LOW_SPRING, top=_SLAB + 0.12, radius=0.58)
        _add_arcade(court, side, spring=_HIGH_SPRING, top=_TOP, radius=0.46)
    _add_columns(court)
    _add_curtains(court)
    _add_balusters(court)
    _add_court(court)
    meshes = court.meshes(triangles)
    with ThreadPoolExecutor(2) as pool:
        sets = list(pool.map(lambda make: make(textures).images(), _SETS.values()))
    materials = []
    for index, name in enumerate(_SETS):
        lit = {"emissive": (7.0, 5.2, 3.0), "emissive_texture": TextureSlot(3 * index)}
        more = lit if name == "lamp" else {"double_sided": "cloth" in name}
        materials.append(mapped(name, 3 * index, 3 * index + 1, **more))
    return Scene(
        name="atrium",
        meshes=tuple(meshes),
        instances=tuple(court.instances()),
        materials=tuple(materials),
        images=triples(sets),
        default_camera={
            "target": [0.0, 0.0, 0.0],
            "eye_direction": [0.36, 0.0, 1.0],
            "up": [0.0, 1.0, 0.0],
            "window_height": 3.0,
            "depth_scale": 0.4,
        },
    )


def _wall(
    court: Parts,
    name: str,
    material: str,
    point: SurfaceMap,
    size: tuple[float, float],
    *,
    tile: float = 2.0,
    detail: float = 1.0,
    least: tuple[int, int] = (1, 1),
) -> None:
    """An open surface whose texture repeats every `tile` metres."""
    court.add(
        Surface(
            name,
            point,
            size,
            court.material(material),
            uv_scale=(max(1.0, size[0] / tile), max(1.0, size[1] / tile)),
            detail=detail,
            least=least,
        )
    )


def _add_shell(court: Parts) -> None:
    w, low, high = _AISLE + _OVERLAP, _FLOOR - _OVERLAP, _CREST + _OVERLAP
    back, front = _BACK - _OVERLAP, _FRONT + _OVERLAP
    d, h = front - back, high - low
    floor = plane((-w, _FLOOR, back), (2 * w, 0, 0), (0, 0, d))
    _wall(court, "floor", "flagstones", floor, (2 * w, d), detail=1.5)
    left = plane((-_AISLE, high, front), (0, 0, -d), (0, -h, 0), _courses)
    _wall(court, "left wall", "brick", left, (d, h))
    right = plane((_AISLE, high, back), (0, 0, d), (0, -h, 0), _courses)
    _wall(court, "right wall", "brick", right, (d, h))
    far = plane((-w, high, _BACK), (2 * w, 0, 0), (0, -h, 0), _apse)
    _wall(court, "back wall", "ashlar", far, (2 * w, h), detail=3.0)
    near = plane((w, high, _FRONT), (-2 * w, 0, 0), (0, -h, 0))
    _wall(court, "front wall", "ashlar", near, (2 * w, h), detail=0.3)
    _wall(court, "vault wall", "plaster", _vault, (2 * _NAVE + 1.6, d), detail=1.5, least=(12, 8))
    for side in (-1, 1):
        # Aisle ceilings, gallery floors and gallery ceilings, from the arcade to the outer wall.
        inner, depth = side * (_NAVE - 0.02), side * (_AISLE - _NAVE + _OVERLAP)
        edges = (inner, inner + depth)
        for name, y, up in (("aisle", _SLAB, -1), ("gallery", _SLAB + 0.1, 1), ("loft", _TOP, -1)):
            start = min(edges)
            corner = (start, y, back if up > 0 else front)
            slab = plane(corner, (abs(depth), 0, 0), (0, 0, up * d))
            _wall(court, f"{name} wall", "plaster" if up < 0 else "flagstones", slab,
                  (abs(depth), d), detail=0.6)  # fmt: skip


def _courses(u: NDArray[np.float32], v: NDArray[np.float32]) -> NDArray[np.float32]:
    """Pilasters a bay apart between a plinth and a string course."""
    bay = np.abs((u * _BAYS) % 1 - np.float32(0.5))
    pilaster = np.float32(0.08) * step(bay, 0.40, 0.03)
    y = _CREST - v * np.float32(_CREST - _FLOOR)
    course = np.float32(0.06) * (step(y, 0.30, 0.04) - step(y, 0.42, 0.04))
    relief: NDArray[np.float32] = np.maximum(pilaster, course) + np.float32(0.07) * (
        1 - step(y, _FLOOR + 0.28, 0.03)
    )
    return relief


def _apse(u: NDArray[np.float32], v: NDArray[np.float32]) -> NDArray[np.float32]:
    """A half-round apse under a ring of moulding, and a wheel window above it."""
    x = (u - np.float32(0.5)) * np.float32(2 * (_AISLE + _OVERLAP))
    y = np.float32(_CREST + _OVERLAP) - v * np.float32(_CREST - _FLOOR + 2 * _OVERLAP)
    radius = np.hypot(x, np.maximum(y + np.float32(0.35), 0.0))
    hollow = np.float32(1.1) * np.sqrt(np.clip(1 - (radius / np.float32(1.1)) ** 2, 0, 1))
    hollow *= step(y, _FLOOR + 0.02, 0.05)
    ring = np.float32(0.1) * (step(radius, 1.12, 0.03) - step(radius, 1.3, 0.04))
    x_wheel, y_wheel = x, y - np.float32(1.55)
    wheel = np.hypot(x_wheel, y_wheel)
    spokes = np.abs(np.sin(6 * np.arctan2(y_wheel, x_wheel)))
    panes = np.float32(0.16) * step(spokes, 0.3, 0.15) * (1 - step(wheel, 0.5, 0.03))
    panes *= step(wheel, 0.14, 0.03)
    rim = np.float32(0.07) * (step(wheel, 0.55, 0.03) - step(wheel, 0.68, 0.04))
    relief: NDArray[np.float32] = ring + rim - hollow - panes
    return relief


def _vault(
    u: NDArray[np.float32], v: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """A flattened barrel over the nave, seen from below, with a rib at every column."""
    d = _FRONT - _BACK + 2 * _OVERLAP
    z = np.float32(_FRONT + _OVERLAP) - v * np.float32(d)
    bay = np.abs(((z - np.float32(_BACK)) / np.float32(_BAY)) % 1 - np.float32(0.5))
    rib = np.float32(0.07) * step(bay, 0.42, 0.03)
    angle = (u - np.float32(0.5)) * np.float32(np.pi)
    coffers = np.maximum(np.abs((u * 9) % 1 - np.float32(0.5)), bay)
    lift = np.maximum(rib, np.float32(0.05) * step(coffers, 0.34, 0.05))
    x = np.sin(angle) * (np.float32(_NAVE + _OVERLAP) - lift)
    y = np.float32(_TOP - 0.02) + np.cos(angle) * (np.float32(_CREST - _TOP) - lift)
    return x, y, z


def _edge(
    spring: float, radius: float
) -> Callable[[NDArray[np.float32]], tuple[NDArray[np.float32], NDArray[np.float32]]]:
    """z and height of an arcade's lower edge, from its front to its back: piers and half-rounds."""

    def line(u: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        bay, t = np.divmod(u * np.float32(_BAYS), 1)
        pier = np.float32(0.5 * _BAY - radius)
        share = np.float32(0.1)  # of a bay's vertices for each half pier
        before, after = np.clip(t / share, 0, 1), np.clip((t - (1 - share)) / share, 0, 1)
        angle = np.clip((t - share) / (1 - 2 * share), 0, 1) * np.float32(np.pi)
        along = pier * before + np.float32(radius) * (1 - np.cos(angle)) + pier * after
        z = np.float32(_FRONT) - bay * np.float32(_BAY) - along
        return z, np.float32(spring) + np.float32(radius) * np.sin(angle)

    return line


def _add_arcade(court: Parts, side: int, *, spring: float, top: float, radius: float) -> None:
    """Both faces of a wall on arches, and the arches' undersides."""
    edge = _edge(spring, radius)
    length = _BAY * _BAYS
    rise = top - spring

    def face(x: float, backwards: bool) -> SurfaceMap:
        def point(
            u: NDArray[np.float32], v: NDArray[np.float32]
        ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
            z, low = edge(1 - u if backwards else u)
            return np.float32(x) + 0 * (u + v), np.float32(top) + (low - np.float32(top)) * v, z

        return point

    def soffit(
        u: NDArray[np.float32], v: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
        z, low = edge(u)
        return np.float32(side * _NAVE) + np.float32(_THICK) * (0.5 - v), low, z

    inner, outer = side * (_NAVE - _THICK / 2), side * (_NAVE + _THICK / 2)
    least = (8 * _BAYS, 2)
    # A face to +x runs from the front back, one to −x the other way, so that u is to the right.
    for x, right in ((inner, side < 0), (outer, side > 0)):
        _wall(court, "arcade wall", "ashlar", face(x, not right), (length, rise), least=least,
              detail=1.5)  # fmt: skip
    _wall(court, "soffit wall", "ashlar", soffit, (1.4 * length, _THICK), least=(8 * _BAYS, 1))


def _places(
    spread: float, y: float, first: int = 0, last: int = _BAYS + 1
) -> list[NDArray[np.float64]]:
    """Between bays on both sides."""
    return [
        at(side * spread, y, _FRONT - _BAY * i, 180.0 * (side > 0))
        for i in range(first, last)
        for side in (-1, 1)
    ]


def _add_columns(court: Parts) -> None:
    for name, foot, spring, width in (
        ("column", _FLOOR, _LOW_SPRING, 0.17),
        ("high column", _SLAB + 0.09, _HIGH_SPRING, 0.11),
    ):
        h = spring - foot + 0.02
        cap = 0.28 * h
        profile = [
            (0.0, h), (1.35 * width, h), (1.35 * width, h - 0.2 * cap),
            (1.1 * width, h - 0.5 * cap), (0.82 * width, h - 0.8 * cap),
            (0.9 * width, h - 0.85 * cap), (0.78 * width, h - cap),
            (0.9 * width, 0.2), (1.15 * width, 0.14), (1.1 * width, 0.1), (1.35 * width, 0.06),
            (1.35 * width, 0.0), (0.0, 0.0),
        ]  # fmt: skip
        column = court.turned(name, "marble", profile, flutes=16, least=(4, 5), detail=3.0)
        court.add(column, *_places(_NAVE, foot - 0.01))


def _add_curtains(court: Parts) -> None:
    """Cloths gathered in folds behind every other lower arch, and banners from the galleries."""

    def hung(width: float, height: float, folds: float, swag: float) -> SurfaceMap:
        def point(
            u: NDArray[np.float32], v: NDArray[np.float32]
        ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
            fold = np.sin(u * np.float32(2 * np.pi * folds)) + 0.4 * np.sin(u * 31 + 3 * v)
            x = (u - np.float32(0.5)) * np.float32(width) * (1 - np.float32(0.25) * swag * v)
            sag = np.float32(0.12 * swag) * np.sin(u * np.float32(np.pi)) * v
            return x, -v * np.float32(height) - sag, np.float32(0.045) * fold * (0.25 + v)

        return point

    kinds = ("red cloth", "green cloth", "blue cloth")
    for index, kind in enumerate(kinds):
        material = court.material(kind)
        curtain = Surface(
            "curtain", hung(1.25, 1.25, 6, 1.0), (2.4, 1.3), material,
            uv_scale=(2.0, 2.0), detail=4.0, least=(14, 4),
        )  # fmt: skip
        z = [_FRONT - _BAY * (bay + 0.5) for bay in range(index, _BAYS, len(kinds))]
        court.add(
            curtain,
            *(at(s * (_NAVE + 0.25), 0.12, depth, -90.0 * s) for depth in z for s in (-1, 1)),
        )
        banner = Surface(
            "banner cloth", hung(0.5, 1.0, 1, 0.0), (0.7, 1.0), material,
            uv_scale=(1.0, 1.0), detail=4.0, least=(6, 3),
        )  # fmt: skip
        z = [_FRONT - _BAY * i for i in range(1 + index, _BAYS, len(kinds))]
        court.add(
            banner,
            *(at(s * (_NAVE - 0.24), 0.62, depth, -90.0 * s) for depth in z for s in (-1, 1)),
        )


def _add_balusters(court: Parts) -> None:
    profile = rounded([
        (0.0, 0.30), (0.035, 0.30), (0.03, 0.26), (0.018, 0.2), (0.042, 0.1), (0.025, 0.03),
        (0.04, 0.0), (0.0, 0.0),
    ], 1)  # fmt: skip
    baluster = court.turned("baluster", "marble", profile, least=(3, 4), detail=6.0, tile=0.2)
    places = [
        at(side * (_NAVE - 0.02), _SLAB + 0.1, _FRONT - _BAY * (bay + (i + 1) / 8))
        for bay in range(_BAYS) for i in range(7) for side in (-1, 1)
    ]  # fmt: skip
    court.add(baluster, *places)
    rail = [(0.0, 0.05), (0.06, 0.05), (0.06, 0.0), (0.0, 0.0)]
    cell = court.turned("rail", "ashlar", rail, square=True, least=(4, 3), detail=2.0)
    court.add(cell, *(
        at(side * (_NAVE - 0.02), _SLAB + 0.4, _FRONT - 0.11 * i)
        for i in range(int(_BAY * _BAYS / 0.11)) for side in (-1, 1)
    ))  # fmt: skip


def _add_court(court: Parts) -> None:
    """A fountain in the middle, urns along the nave, lamps on chains."""
    bowl = rounded([
        (0.0, 0.62), (0.05, 0.62), (0.10, 0.60), (0.52, 0.72), (0.56, 0.70), (0.50, 0.60),
        (0.12, 0.50), (0.10, 0.35), (0.22, 0.12), (0.34, 0.08), (0.36, 0.0), (0.0, 0.0),
    ])  # fmt: skip
    court.add(court.turned("bowl", "marble", bowl, detail=6.0), at(0.0, _FLOOR - 0.01, -0.6))
    basin = [
        (0.0, 0.10), (0.92, 0.10), (0.94, 0.30), (1.08, 0.32), (1.08, 0.24), (1.0, 0.2),
        (1.04, 0.04), (1.1, 0.0), (0.0, 0.0),
    ]  # fmt: skip
    court.add(court.turned("basin", "ashlar", basin, detail=3.0), at(0.0, _FLOOR - 0.01, -0.6))
    finial = Surface(
        "finial", sphere(0.17, _pine), (1.1, 0.55), court.material("bronze"), closed_u=True,
        poles=True, uv_scale=(2.0, 1.0), detail=10.0, least=(8, 5),
    )  # fmt: skip
    court.add(finial, at(0.0, _FLOOR + 0.78, -0.6))
    urn = rounded([
        (0.0, 0.60), (0.12, 0.60), (0.20, 0.64), (0.17, 0.56), (0.12, 0.50), (0.24, 0.40),
        (0.22, 0.25), (0.08, 0.14), (0.15, 0.06), (0.18, 0.0), (0.0, 0.0),
    ])  # fmt: skip
    spots = [(s * 1.55, z) for z in (1.35, -0.6, -2.6, -4.6, -6.4) for s in (-1, 1)]
    court.add(court.turned("urn", "bronze", urn, detail=6.0), *(at(x, _FLOOR, z) for x, z in spots))
    places = [(s * 0.95, 0.62 + 0.12 * (i % 2), 1.6 - 1.5 * i) for i in range(6) for s in (-1, 1)]
    lamp = Surface(
        "lamp", sphere(0.11), (0.7, 0.35), court.material("lamp"), closed_u=True, poles=True,
        detail=6.0, least=(6, 4),
    )  # fmt: skip
    court.add(lamp, *(at(*place) for place in places))
    chain = [(0.0, 2.0), (0.012, 1.99), (0.012, 0.1), (0.06, 0.08), (0.07, 0.0), (0.0, 0.0)]
    court.add(
        court.turned("chain", "gilt", chain, least=(3, 4), detail=2.0, tile=0.4),
        *(at(x, y + 0.09, z) for x, y, z in places),
    )


def _pine(u: NDArray[np.float32], v: NDArray[np.float32]) -> NDArray[np.float32]:
    """Scales in spirals, as of a pine cone."""
    turn = np.float32(2 * np.pi)
    scales = np.cos(turn * (8 * u + 4 * v)) * np.cos(turn * (8 * u - 4 * v))
    relief: NDArray[np.float32] = 0.1 * scales * np.sin(v * np.float32(np.pi))
    return relief

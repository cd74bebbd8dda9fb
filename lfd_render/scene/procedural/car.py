"""`builtin:car`: a car without textures whose body hides what it is made of.

Metres; the car is 3.9 long, its nose at +x and its wheels on y = −0.62. Engine, gears, axles,
springs, pipes, seats and hundreds of bolts lie inside closed shells: a ray through the middle
crosses up to fifty surfaces and, for a third of the rays, eight and more.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from lfd_render.scene.model import Material, Scene
from lfd_render.scene.procedural.grid import Surface, SurfaceMap
from lfd_render.scene.procedural.parts import Matrix, Parts, at
from lfd_render.scene.procedural.shapes import lathe, rounded, sphere, torus_knot

Floats = NDArray[np.float32]
Points = tuple[Floats, Floats, Floats]
Line = NDArray[np.float64]  # [n]
Doubles = tuple[Line, ...]
Curve = Callable[[Line], Doubles]  # t from 0 to 1 → x, y, z

_PAINTS = {
    "red paint": Material("red paint", (0.42, 0.015, 0.02, 1.0), 0.25, 0.16),
    "dark glass": Material("dark glass", (0.012, 0.016, 0.02, 1.0), 0.0, 0.05),
    "rubber": Material("rubber", (0.02, 0.02, 0.021, 1.0), 0.0, 0.85),
    "chrome": Material("chrome", (0.80, 0.81, 0.83, 1.0), 1.0, 0.10),
    "steel": Material("steel", (0.45, 0.46, 0.48, 1.0), 1.0, 0.45),
    "cast iron": Material("cast iron", (0.10, 0.10, 0.11, 1.0), 0.6, 0.65),
    "copper": Material("copper", (0.85, 0.48, 0.30, 1.0), 1.0, 0.35),
    "leather": Material("leather", (0.26, 0.12, 0.05, 1.0), 0.0, 0.55),
    "lamp": Material("lamp", (0.9, 0.9, 0.85, 1.0), 0.0, 0.2, emissive=(1.6, 1.5, 1.3)),
    "tail lamp": Material(
        "tail lamp", (0.5, 0.02, 0.02, 1.0), 0.0, 0.2, emissive=(1.2, 0.03, 0.03)
    ),
}
_AXLES, _TRACK, _HUB = (1.22, -1.18), 0.80, -0.30


def car(triangles: int) -> Scene:
    """The car with about `triangles` triangles, none with a texture."""
    parts = Parts(tuple(_PAINTS))
    _add_body(parts)
    _add_wheels(parts)
    _add_engine(parts)
    _add_chassis(parts)
    _add_cabin(parts)
    meshes = parts.meshes(triangles)
    return Scene(
        name="car",
        meshes=tuple(meshes),
        instances=tuple(parts.instances()),
        materials=tuple(_PAINTS.values()),
        default_camera={
            "target": [0.0, 0.02, 0.0],
            "eye_direction": [0.75, 0.38, 1.0],
            "up": [0.0, 1.0, 0.0],
            "window_height": 2.35,
            "depth_scale": 0.6,
        },
    )


def _loft(stations: Sequence[tuple[float, float, float, float]], power: float = 4.0) -> SurfaceMap:
    """A closed hull of rounded boxes round the x axis: (x, half width, bottom, top) a station.

    v runs along x, u round the section, a superellipse of that power.
    """
    line = np.array(stations, np.float64)
    knots = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(line[:, [0, 3]], axis=0).T))))
    knots /= knots[-1]

    def point(u: Floats, v: Floats) -> Points:
        x, half, low, high = (np.interp(v, knots, line[:, i]).astype(np.float32) for i in range(4))
        # Ends close to a point within the first and last hundredth.
        close = np.clip(np.minimum(v, 1 - v) * 60, 0, 1) ** np.float32(0.5)
        angle = u * np.float32(2 * np.pi)
        sin, cos = np.sin(angle), np.cos(angle)
        z = np.sign(cos) * np.abs(cos) ** np.float32(2 / power)
        y = np.sign(sin) * np.abs(sin) ** np.float32(2 / power)
        middle, rise = 0.5 * (low + high), 0.5 * (high - low)
        return x + 0 * z, middle + rise * close * y, half * close * z

    return point


def _hull(
    parts: Parts, name: str, material: str, stations: Sequence[tuple[float, float, float, float]],
    *, detail: float = 1.0, power: float = 4.0, least: tuple[int, int] = (8, 8),
) -> Surface:  # fmt: skip
    line = np.array(stations)
    along = float(np.ptp(line[:, 0]))
    around = 4 * float(line[:, 1].max()) + 2 * float((line[:, 3] - line[:, 2]).max())
    return Surface(
        name, _loft(stations, power), (around, along), parts.material(material),
        closed_u=True, poles=True, detail=detail, least=least,
    )  # fmt: skip


def _pipe(
    parts: Parts, name: str, material: str, centre: Curve, *,
    length: float, radius: float, detail: float = 2.0, least: tuple[int, int] = (5, 8),
) -> Surface:  # fmt: skip
    """A tube along a curve, its ends closed: u runs round it, v along it."""

    def point(u: Floats, v: Floats) -> Points:
        t = v[:, 0].astype(np.float64)
        step = 1e-3
        middle = np.stack(centre(t), axis=-1)
        tangent = np.stack(centre(t + step), axis=-1) - np.stack(centre(t - step), axis=-1)
        tangent /= np.linalg.norm(tangent, axis=-1, keepdims=True)
        side = np.cross(tangent, (0.31, 0.83, 0.47))  # parallel to none of the curves
        side /= np.linalg.norm(side, axis=-1, keepdims=True)
        up = np.cross(side, tangent)
        wide = radius * np.minimum(1.0, 50 * np.minimum(t, 1 - t))[:, None, None]
        angle = u[0].astype(np.float64)[None, :, None] * 2 * np.pi
        found = middle[:, None] + wide * (
            np.cos(angle) * side[:, None] + np.sin(angle) * up[:, None]
        )
        x, y, z = np.moveaxis(found.astype(np.float32), -1, 0)
        return x, y, z

    return Surface(
        name, point, (2 * np.pi * radius, length), parts.material(material),
        closed_u=True, poles=True, detail=detail, least=least,
    )  # fmt: skip


def _turning(
    parts: Parts, name: str, material: str, profile: list[tuple[float, float]], **choices: float
) -> Surface:
    return parts.turned(name, material, profile, least=(8, 5), **choices)  # type: ignore[arg-type]


def _sideways(x: float, y: float, z: float, *, flip: bool = False) -> Matrix:
    """A thing turned about the y axis, its axis laid along z; flipped, its top at −z."""
    matrix = np.eye(4)
    matrix[:3, :3] = [[1, 0, 0], [0, 0, 1 if flip else -1], [0, -1 if flip else 1, 0]]
    matrix[:3, 3] = (x, y, z)
    return matrix


def _lengthwise(x: float, y: float, z: float) -> Matrix:
    """A thing turned about the y axis, its axis laid along x."""
    return at(x, y, z, tilt_deg=-90.0)


def _add_body(parts: Parts) -> None:
    body = [
        (-1.98, 0.55, -0.20, 0.02), (-1.92, 0.74, -0.34, 0.18), (-1.6, 0.82, -0.40, 0.24),
        (-1.1, 0.84, -0.42, 0.25), (-0.4, 0.83, -0.43, 0.22), (0.4, 0.83, -0.43, 0.21),
        (0.9, 0.83, -0.42, 0.16), (1.5, 0.80, -0.38, 0.06), (1.85, 0.70, -0.32, -0.06),
        (1.95, 0.50, -0.22, -0.12),
    ]  # fmt: skip
    parts.add(_hull(parts, "body", "red paint", body, detail=1.5, power=4.5))
    cabin = [
        (-1.35, 0.60, 0.16, 0.22), (-0.95, 0.66, 0.16, 0.50), (-0.45, 0.66, 0.16, 0.66),
        (0.05, 0.65, 0.16, 0.66), (0.45, 0.66, 0.14, 0.46), (0.80, 0.64, 0.12, 0.20),
    ]  # fmt: skip
    parts.add(_hull(parts, "glass", "dark glass", cabin, power=3.2))
    lining = [(x, 0.96 * half, low + 0.03, high - 0.03) for x, half, low, high in body[1:-1]]
    parts.add(_hull(parts, "lining", "leather", lining, power=4.5))
    roof = [
        (-0.80, 0.52, 0.50, 0.56), (-0.45, 0.60, 0.56, 0.69), (0.05, 0.59, 0.56, 0.69),
        (0.24, 0.52, 0.50, 0.57),
    ]  # fmt: skip
    parts.add(_hull(parts, "roof", "red paint", roof, power=3.0))
    sill = [(-0.8, 0.86, -0.44, -0.34), (0.0, 0.87, -0.45, -0.33), (0.8, 0.86, -0.44, -0.34)]
    parts.add(_hull(parts, "sill", "chrome", sill))
    for name, x, width, y in (
        ("front bumper", 1.93, 0.74, -0.26),
        ("rear bumper", -1.96, 0.76, -0.22),
    ):

        def bow(t: Line, x: float = x, width: float = width, y: float = y) -> Doubles:
            z = (2 * t - 1) * width
            return x - np.sign(x) * 0.35 * (z / width) ** 4, y + 0 * t, z

        parts.add(_pipe(parts, name, "chrome", bow, length=1.9, radius=0.045))
    lens = Surface("head lamp", sphere(0.1), (0.6, 0.3), parts.material("lamp"), closed_u=True,
                   poles=True, detail=4.0, least=(8, 5))  # fmt: skip
    parts.add(lens, *(at(1.80, -0.10, s * 0.52) for s in (-1, 1)))
    rim = [(0.0, 0.05), (0.10, 0.05), (0.125, 0.03), (0.12, -0.05), (0.0, -0.05)]
    parts.add(_turning(parts, "lamp rim", "chrome", rounded(rim)),
              *(_lengthwise(1.76, -0.10, s * 0.52) for s in (-1, 1)))  # fmt: skip
    tail = Surface("tail lamp", sphere(0.075), (0.45, 0.22), parts.material("tail lamp"),
                   closed_u=True, poles=True, detail=4.0, least=(8, 5))  # fmt: skip
    parts.add(tail, *(at(-1.93, 0.03, s * (0.44 + d)) for s in (-1, 1) for d in (0.0, 0.16)))
    bars = [(0.0, 0.36), (0.008, 0.35), (0.008, -0.35), (0.0, -0.36)]
    parts.add(_turning(parts, "grill", "chrome", bars),
              *(_sideways(1.93 - 0.012 * i, -0.17 + 0.03 * i, 0.0) for i in range(5)))  # fmt: skip
    mirror = [(0.44, 0.05, 0.24, 0.30), (0.50, 0.07, 0.22, 0.33), (0.60, 0.03, 0.25, 0.30)]
    for side in (-1, 1):
        parts.add(_hull(parts, "mirror", "red paint", mirror, power=2.5, detail=3.0),
                  at(0.0, 0.02, side * 0.78))  # fmt: skip


def _add_wheels(parts: Parts) -> None:
    tyre = rounded([
        (0.0, 0.02), (0.2, 0.02), (0.22, 0.11), (0.27, 0.12), (0.315, 0.09), (0.32, 0.05),
        (0.32, -0.05), (0.315, -0.09), (0.27, -0.12), (0.22, -0.11), (0.2, -0.06), (0.0, -0.06),
    ], 2)  # fmt: skip
    rim = [
        (0.0, 0.06), (0.05, 0.06), (0.06, 0.03), (0.19, 0.075), (0.21, 0.125), (0.225, 0.12),
        (0.22, 0.0), (0.0, -0.02),
    ]  # fmt: skip
    disc = [(0.0, 0.02), (0.17, 0.02), (0.17, -0.01), (0.06, -0.01), (0.05, -0.08), (0.0, -0.08)]
    spoke = [(0.0, 0.19), (0.018, 0.18), (0.028, 0.05), (0.0, 0.04)]
    nut = [(0.0, 0.02), (0.014, 0.02), (0.016, -0.01), (0.0, -0.02)]
    places = [(x, _HUB, side * _TRACK, side < 0) for x, side in product(_AXLES, (-1, 1))]

    where = [_sideways(x, y, z, flip=flip) for x, y, z, flip in places]
    parts.add(_turning(parts, "tyre", "rubber", tyre), *where)
    parts.add(_turning(parts, "rim", "steel", rim), *where)
    parts.add(_turning(parts, "brake disc", "cast iron", disc), *where)
    spokes = [
        _sideways(x, y, z, flip=flip) @ at(0, 0.10, 0, 36.0 * i, tilt_deg=90)
        for x, y, z, flip in places
        for i in range(10)
    ]  # fmt: skip
    parts.add(_turning(parts, "spoke", "chrome", spoke), *spokes)
    nuts = [
        _sideways(x, y, z, flip=flip) @ at(0, 0, 0, 72.0 * i) @ at(0.06, 0.09, 0)
        for x, y, z, flip in places
        for i in range(5)
    ]  # fmt: skip
    parts.add(_turning(parts, "wheel nut", "chrome", nut), *nuts)


def _add_engine(parts: Parts) -> None:
    block = [(0.92, 0.20, -0.30, -0.08), (0.95, 0.24, -0.34, -0.05), (1.5, 0.24, -0.34, -0.05),
             (1.53, 0.20, -0.30, -0.08)]  # fmt: skip
    parts.add(_hull(parts, "block", "cast iron", block, power=8.0))
    cylinder = [(0.0, 0.2)]
    for i in range(8):  # cooling fins
        y = 0.19 - 0.022 * i
        cylinder += [(0.062, y), (0.062, y - 0.008), (0.045, y - 0.010), (0.045, y - 0.020)]
    cylinder += [(0.045, -0.02), (0.0, -0.02)]
    bank = [
        at(1.02 + 0.14 * i, -0.19, s * 0.09, 90.0 * s) for i in range(4) for s in (-1, 1)
    ]  # fmt: skip
    parts.add(_turning(parts, "cylinder", "steel", cylinder), *bank)
    fan = [(0.0, 0.03), (0.04, 0.03), (0.05, 0.0), (0.15, 0.006), (0.16, -0.004), (0.0, -0.01)]
    parts.add(_turning(parts, "fan", "steel", fan), _lengthwise(1.62, -0.18, 0.0))
    tubes = [(0.0, 0.13), (0.007, 0.125), (0.007, -0.125), (0.0, -0.13)]
    parts.add(_turning(parts, "radiator tube", "copper", tubes),
              *(at(1.72 + 0.02 * (i % 2), -0.17, 0.018 * i - 0.36) for i in range(41)))  # fmt: skip
    for side in (-1, 1):
        for i in range(4):

            def header(t: Line, side: int = side, i: int = i) -> Doubles:
                start = 1.02 + 0.14 * i
                bend = np.sin(0.5 * np.pi * t)
                return (
                    start - (start - 0.75) * t**2,
                    -0.06 - 0.36 * t**2,
                    side * (0.14 + 0.16 * bend * (1 - t) + 0.14 * t),
                )

            parts.add(_pipe(parts, "header", "steel", header, length=0.6, radius=0.022))
    teeth = 18
    wheel = [(0.0, 0.03), (0.12, 0.03), (0.12, -0.03), (0.0, -0.03)]
    gear = Surface(
        "gear", _toothed(lathe(wheel), teeth, 0.12), (0.75, 0.3), parts.material("steel"),
        closed_u=True, poles=True, detail=8.0, least=(2 * teeth, 4),
    )  # fmt: skip
    parts.add(gear, *(_lengthwise(0.74 - 0.075 * i, -0.26 + 0.1 * (i % 2), 0.03) for i in range(6)))
    bell = [(0.26, 0.10, -0.38, -0.14), (0.34, 0.17, -0.42, -0.06), (0.72, 0.20, -0.44, -0.02),
            (0.86, 0.24, -0.44, 0.02)]  # fmt: skip
    parts.add(_hull(parts, "gearbox", "cast iron", bell, power=3.0))
    bolt = [
        (0.0, 0.012),
        (0.011, 0.011),
        (0.012, 0.0),
        (0.005, -0.01),
        (0.005, -0.04),
        (0.0, -0.04),
    ]
    rows = [
        at(0.97 + 0.056 * i, -0.05, s * z) for i in range(10) for z in (0.2, 0.22) for s in (-1, 1)
    ]
    rows += [at(0.3 + 0.05 * i, -0.03, s * 0.16) for i in range(11) for s in (-1, 1)]
    parts.add(_turning(parts, "bolt", "steel", bolt), *rows)


def _toothed(round_map: SurfaceMap, teeth: int, radius: float) -> SurfaceMap:
    """A lathe whose rim steps out and in as teeth do."""

    def point(u: Floats, v: Floats) -> Points:
        x, y, z = round_map(u, v)
        wave = np.clip(3 * np.sin(u * np.float32(2 * np.pi * teeth)), -1, 1)
        rim = np.clip((np.hypot(x, z) / np.float32(radius) - 0.6) * 2.5, 0, 1)
        scale = 1 + np.float32(0.09) * wave * rim
        return x * scale, y + 0 * x, z * scale

    return point


def _add_chassis(parts: Parts) -> None:
    shaft = [(0.0, 0.78), (0.03, 0.78), (0.03, -0.78), (0.0, -0.78)]
    parts.add(_turning(parts, "axle", "steel", shaft),
              *(_sideways(x, _HUB, 0.0) for x in _AXLES))  # fmt: skip
    drive = [(0.0, 0.72), (0.035, 0.71), (0.035, -0.71), (0.0, -0.72)]
    parts.add(_turning(parts, "drive shaft", "steel", drive), _lengthwise(-0.44, -0.30, 0.0))
    casing = Surface("differential", sphere(0.14), (0.9, 0.45), parts.material("cast iron"),
                     closed_u=True, poles=True, detail=3.0, least=(10, 6))  # fmt: skip
    parts.add(casing, at(_AXLES[1], _HUB, 0.0))

    def coil(t: Line) -> Doubles:
        turn = 2 * np.pi * 7 * t
        return 0.06 * np.cos(turn), 0.34 * t, 0.06 * np.sin(turn)

    places = [at(x, _HUB - 0.02, s * 0.58) for x in _AXLES for s in (-1, 1)]
    spring = _pipe(
        parts, "spring", "steel", coil, length=2.7, radius=0.011, detail=6.0, least=(5, 60)
    )
    parts.add(spring, *places)
    damper = [(0.0, 0.36), (0.018, 0.36), (0.018, 0.2), (0.03, 0.19), (0.03, 0.0), (0.0, 0.0)]
    parts.add(_turning(parts, "damper", "chrome", damper), *places)
    for side in (-1, 1):

        def exhaust(t: Line, side: int = side) -> Doubles:
            return (
                0.75 - 2.72 * t,
                -0.42 + 0.05 * np.sin(9 * t),
                side * (0.42 + 0.06 * np.sin(6 * t)),
            )

        parts.add(_pipe(parts, "exhaust", "steel", exhaust, length=2.8, radius=0.03))
        rail = [(-1.7, 0.04, -0.40, -0.34), (0.0, 0.05, -0.43, -0.36), (1.6, 0.04, -0.36, -0.30)]
        parts.add(_hull(parts, "rail", "cast iron", rail, power=8.0), at(0, 0, side * 0.5))
    muffler = [(0.0, 0.24), (0.08, 0.23), (0.10, 0.2), (0.10, -0.2), (0.08, -0.23), (0.0, -0.24)]
    parts.add(_turning(parts, "muffler", "steel", muffler),
              *(_lengthwise(-1.5, -0.36, s * 0.42) for s in (-1, 1)))  # fmt: skip
    tank = [(-1.7, 0.3, -0.22, 0.0), (-1.65, 0.36, -0.26, 0.04), (-1.35, 0.36, -0.26, 0.04),
            (-1.3, 0.3, -0.22, 0.0)]  # fmt: skip
    parts.add(_hull(parts, "tank", "steel", tank, power=5.0))
    floor = [(-1.2, 0.7, -0.37, -0.35), (0.0, 0.74, -0.38, -0.35), (0.85, 0.7, -0.37, -0.35)]
    parts.add(_hull(parts, "floor pan", "cast iron", floor, power=10.0))


def _add_cabin(parts: Parts) -> None:
    seat = [(-0.26, 0.20, -0.32, -0.12), (-0.2, 0.23, -0.34, -0.08), (0.16, 0.23, -0.34, -0.10),
            (0.22, 0.19, -0.30, -0.14)]  # fmt: skip
    back = [(-0.34, 0.18, -0.14, 0.40), (-0.30, 0.21, -0.18, 0.46), (-0.20, 0.21, -0.18, 0.44),
            (-0.16, 0.17, -0.14, 0.38)]  # fmt: skip
    places = [at(x, 0.0, s * 0.32) for x in (0.0, -0.72) for s in (-1, 1)]
    parts.add(_hull(parts, "seat", "leather", seat, power=3.5, detail=2.0), *places)
    parts.add(_hull(parts, "seat back", "leather", back, power=3.5, detail=2.0), *places)
    dash = [(0.42, 0.60, -0.05, 0.10), (0.5, 0.63, -0.08, 0.16), (0.66, 0.63, -0.08, 0.16)]
    parts.add(_hull(parts, "dashboard", "leather", dash, power=3.0))
    ring = Surface("steering wheel", torus_knot(1, 0, 0.19, 0.014), (1.2, 0.09),
                   parts.material("rubber"), closed_u=True, closed_v=True, detail=6.0,
                   least=(16, 4))  # fmt: skip
    parts.add(ring, at(0.34, 0.16, 0.32, 78.0))
    dial = [(0.0, 0.01), (0.05, 0.01), (0.055, 0.0), (0.0, -0.01)]
    parts.add(_turning(parts, "dial", "chrome", dial),
              *(_lengthwise(0.43, 0.06, 0.2 + 0.12 * i) for i in range(3)))  # fmt: skip

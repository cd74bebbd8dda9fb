"""Surface maps of the built-in scenes: planes, boxes' sides, spheres, lathes, torus knots."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from lfd_render.scene.procedural.grid import SurfaceMap

Vector = Sequence[float]
Relief = Callable[[NDArray[np.float32], NDArray[np.float32]], NDArray[np.float32]]

_TAU = np.float32(2.0 * np.pi)


def plane(corner: Vector, right: Vector, down: Vector, relief: Relief | None = None) -> SurfaceMap:
    """A parallelogram from its top left corner; relief lifts points along the front normal."""
    origin, along, across = (np.asarray(v, np.float32) for v in (corner, right, down))
    normal = np.cross(across, along)
    normal = normal / np.linalg.norm(normal)

    def point(
        u: NDArray[np.float32], v: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
        lift = np.float32(0.0) if relief is None else relief(u, v)
        x, y, z = (origin[i] + along[i] * u + across[i] * v + normal[i] * lift for i in range(3))
        return x, y, z

    return point


def sphere(radius: float, bumps: Relief | None = None) -> SurfaceMap:
    """A sphere round the origin, poles on ±y; bumps add to the radius, in units of it."""

    def point(
        u: NDArray[np.float32], v: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
        longitude, colatitude = u * _TAU, v * np.float32(np.pi)
        r = np.float32(radius) * (1 if bumps is None else 1 + bumps(u, v))
        ring = r * np.sin(colatitude)
        return ring * np.sin(longitude), r * np.cos(colatitude), ring * np.cos(longitude)

    return point


def rounded(profile: Sequence[tuple[float, float]], times: int = 3) -> list[tuple[float, float]]:
    """The corners of a profile cut `times` over (Chaikin 1974), its ends kept."""
    line = np.array(profile)
    for _ in range(times):
        near = 0.75 * line[:-1] + 0.25 * line[1:]
        far = 0.25 * line[:-1] + 0.75 * line[1:]
        cut = np.stack((near, far), axis=1).reshape(-1, 2)
        line = np.concatenate((line[:1], cut[1:-1], line[-1:]))
    return [(float(r), float(y)) for r, y in line]


def lathe(
    profile: Sequence[tuple[float, float]], *, square: bool = False, flutes: int = 0
) -> SurfaceMap:
    """A closed surface round the y axis through (radius, height) corners, from its top down.

    First and last radius are 0. `square` turns circles into squares, radius then being half a
    side; corners lie at multiples of 1/4 in u. `flutes` grooves run down the longest stretch.
    """
    radii, heights = (np.array(c, np.float64) for c in zip(*profile, strict=True))
    steps = np.hypot(np.diff(radii), np.diff(heights))
    knots = np.concatenate(([0.0], np.cumsum(steps))) / steps.sum()
    shaft = int(np.argmax(steps))

    def point(
        u: NDArray[np.float32], v: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
        r = np.interp(v, knots, radii).astype(np.float32)
        y = np.interp(v, knots, heights).astype(np.float32)
        angle = u * _TAU
        sin, cos = np.sin(angle), np.cos(angle)
        if square:
            sin, cos = _square(u)
        if flutes:
            groove = np.abs(np.sin(u * np.float32(np.pi * flutes)))
            r = r * (1 - np.float32(0.07) * _inside(v, knots[shaft], knots[shaft + 1]) * groove)
        return r * sin, y, r * cos

    return point


def _square(u: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """A unit square's outline, [2] arrays, from (−1, 1) to (1, 1) and round to the start."""
    side, along = np.divmod(u * np.float32(4.0), 1.0)
    along = 2 * along - 1
    x = np.choose(side.astype(np.int32) % 4, (along, np.ones_like(u), -along, -np.ones_like(u)))
    z = np.choose(side.astype(np.int32) % 4, (np.ones_like(u), -along, -np.ones_like(u), along))
    return x, z


def _inside(v: NDArray[np.float32], start: float, end: float) -> NDArray[np.float32]:
    """1 between start and end, with short ramps to 0 at both."""
    ramp = np.minimum(v - start, end - v) / (0.04 * (end - start))
    clipped: NDArray[np.float32] = np.clip(ramp, 0.0, 1.0).astype(np.float32)
    return clipped


def frame(width: float, height: float, rim: float, depth: float) -> SurfaceMap:
    """A closed picture frame round a width × height opening in the xy plane, back at z = 0.

    u runs round the opening from its top left corner, v round the frame's cross-section;
    corners lie at multiples of 1/4 in u.
    """
    # Outer edge, crest, inner lip and back of the section, as (outward, forward).
    section = np.array(
        [
            (rim, 0.0),
            (0.8 * rim, 0.8 * depth),
            (0.5 * rim, depth),
            (0.15 * rim, 0.55 * depth),
            (0.0, 0.5 * depth),
            (0.0, 0.0),
            (rim, 0.0),
        ]
    )
    steps = np.hypot(*np.diff(section, axis=0).T)
    knots = np.concatenate(([0.0], np.cumsum(steps))) / steps.sum()

    def point(
        u: NDArray[np.float32], v: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
        outward = np.interp(v, knots, section[:, 0]).astype(np.float32)
        forward = np.interp(v, knots, section[:, 1]).astype(np.float32)
        x, y = _square(u)  # clockwise as seen from the front, left to right on top
        return x * (width / 2 + outward), y * (height / 2 + outward), forward + 0 * u

    return point


def torus_knot(p: int, q: int, radius: float, tube: float) -> SurfaceMap:
    """A (p, q) torus knot of outer extent about `radius + tube`, standing in the xy plane."""

    def centre(t: NDArray[np.float64]) -> NDArray[np.float64]:
        ring = radius * (2.0 + np.cos(q * t)) / 3.0
        depth = -radius * np.sin(q * t) / 3.0
        return np.stack((ring * np.cos(p * t), ring * np.sin(p * t), depth), axis=-1)

    def point(
        u: NDArray[np.float32], v: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
        # u runs along the knot, v round the tube; the frame is the one that turns with the
        # knot's own axis, so it closes after one round.
        t = u[0].astype(np.float64) * 2.0 * np.pi
        step = 1e-3
        middle = centre(t)
        tangent = centre(t + step) - centre(t - step)
        outward = middle + 0.5 * (centre(t + step) + centre(t - step) - 2.0 * middle)
        side = np.cross(tangent, outward)
        side /= np.linalg.norm(side, axis=-1, keepdims=True)
        up = np.cross(side, tangent)
        up /= np.linalg.norm(up, axis=-1, keepdims=True)
        angle = v * _TAU
        cos, sin = np.cos(angle) * np.float32(tube), np.sin(angle) * np.float32(tube)
        m, s, n = (a.astype(np.float32) for a in (middle, side, up))
        x, y, z = (m[:, i] + cos * n[:, i] + sin * s[:, i] for i in range(3))
        return x, y, z

    return point

"""Surface maps of the built-in scenes: planes, boxes' sides, spheres, lathes, torus knots."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from .grid import SurfaceMap

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


def lathe(
    profile: Sequence[tuple[float, float]], flutes: int = 0, depth: float = 0.0
) -> SurfaceMap:
    """A surface of revolution about y through (radius, height) corners, top first.

    `flutes` grooves of `depth` (in units of the radius) run down the longest stretch.
    """
    radii, heights = (np.array(c, np.float32) for c in zip(*profile, strict=True))
    steps = np.hypot(np.diff(radii), np.diff(heights))
    knots = np.concatenate(([0.0], np.cumsum(steps))).astype(np.float32) / steps.sum()
    shaft = int(np.argmax(steps))
    start, end = knots[shaft], knots[shaft + 1]

    def point(
        u: NDArray[np.float32], v: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
        r = np.interp(v, knots, radii).astype(np.float32)
        if flutes:
            margin = np.minimum(v - start, end - v) / ((end - start) * np.float32(0.04))
            fade = np.clip(margin, 0.0, 1.0).astype(np.float32)
            groove = np.abs(np.sin(u * np.float32(np.pi * flutes)))
            r = r * (1 - np.float32(depth) * fade * groove)
        angle = u * _TAU
        return r * np.sin(angle), np.interp(v, knots, heights).astype(np.float32), r * np.cos(angle)

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

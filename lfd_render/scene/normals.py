"""Normals where a file has none, and unit length where it has some."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Vectors = NDArray[np.float32]
Triangles = NDArray[np.uint32]


def face_normals(positions: NDArray[np.floating], triangles: Triangles) -> NDArray[np.float64]:
    """Normal of each triangle, [m, 3], in proportion to its area; counter-clockwise is the front.

    Edges are scaled by the longest, so that neither tiny nor huge meshes underflow or overflow.
    """
    corners = positions[triangles].astype(np.float64)
    first = corners[:, 1] - corners[:, 0]
    second = corners[:, 2] - corners[:, 0]
    scale = max(float(np.abs(first).max(initial=0.0)), float(np.abs(second).max(initial=0.0)))
    if scale > 0.0:
        first /= scale
        second /= scale
    # Not np.cross, whose overhead is most of the time for a mesh of few triangles.
    (ux, uy, uz), (vx, vy, vz) = first.T, second.T
    return np.stack((uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx), axis=1)


def smooth_normals(positions: Vectors, triangles: Triangles) -> Vectors:
    """Unit normals of the vertices, [n, 3]: the mean of their triangles', weighted by area."""
    faces = face_normals(positions, triangles)
    total = np.empty((len(positions), 3), np.float64)
    corners = triangles.ravel()
    for axis in range(3):
        total[:, axis] = np.bincount(corners, np.repeat(faces[:, axis], 3), len(positions))
    return unit(total)


def unit(vectors: NDArray[np.floating]) -> Vectors:
    """Vectors of length one, [n, 3] float32; +z where there is no direction."""
    wide = np.array(vectors, np.float64)
    wide[~np.isfinite(wide).all(axis=1)] = 0.0
    # Dividing by the largest component first keeps squares within range.
    largest = np.abs(wide).max(axis=1, initial=0.0, keepdims=True)
    np.divide(wide, largest, out=wide, where=largest > 0.0)
    length = np.sqrt(np.einsum("nc,nc->n", wide, wide))[:, None]
    np.divide(wide, length, out=wide, where=length > 0.0)
    wide[length[:, 0] == 0.0] = (0.0, 0.0, 1.0)
    return wide.astype(np.float32)


def without_direction(normals: Vectors) -> NDArray[np.bool_]:
    """Which of the vectors, [n], are zero or not finite, and so are no normals."""
    bad: NDArray[np.bool_] = np.logical_or(~np.isfinite(normals).all(axis=1), ~normals.any(axis=1))
    return bad

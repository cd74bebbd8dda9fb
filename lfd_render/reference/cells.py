"""The paper's lattice: a triangle in its own plane, in level cells as small as any view's pixels.

Gavane and Watson 2024, section 3.1: axes are aligned to the display's horizontal and vertical, and
steps are a view pixel's sides, projected back to the triangle at the point closest to the eye, the
shortest over the views; where texels are larger, equation 3 lengthens both.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import Rig, ViewGrid
from lfd_render.reference.points import eye_sides, most_texels, pixel_sides_mm
from lfd_render.reference.transform import Triangles
from lfd_render.scene import Scene

Float64 = NDArray[np.float64]

MOST_CELLS = 2048  # of a lattice along a side; larger triangles have larger cells


@dataclass(frozen=True, eq=False)
class Lattice:
    """A triangle's lattice. axes: [2, 3], unit, the first level; origin_mm: [3], the low corner;
    step_mm: [2]; corners: the triangle's, [3, 2], in cells from the origin."""

    axes: Float64
    origin_mm: Float64
    step_mm: Float64
    corners: Float64

    @property
    def counts(self) -> tuple[int, int]:
        """Cells along both axes."""
        along_u, along_v = np.floor(self.corners.max(axis=0)).astype(int) + 1
        return int(along_u), int(along_v)

    def touches(self, cell: tuple[int, int], margin: float = 0.0) -> bool:
        """Whether a cell, larger by a margin in cells on all sides, meets the triangle: no line
        along an edge of either lies between them."""
        low, high = np.array(cell) - margin, np.array(cell) + 1.0 + margin
        square = np.array([low, (high[0], low[1]), high, (low[0], high[1])])
        edges = np.roll(self.corners, -1, axis=0) - self.corners
        normals = np.vstack([np.eye(2), np.stack([-edges[:, 1], edges[:, 0]], axis=1)])
        of_cell, of_triangle = square @ normals.T, self.corners @ normals.T
        apart = (of_cell.max(axis=0) < of_triangle.min(axis=0)) | (
            of_triangle.max(axis=0) < of_cell.min(axis=0)
        )
        return not apart.any()

    def centre_mm(self, p_display: Float64) -> Float64:
        """Centre [3] of the cell that a point of the plane lies in."""
        mm = self.axes @ (p_display - self.origin_mm)
        centre: Float64 = (np.floor(mm / self.step_mm) + 0.5) * self.step_mm
        return np.asarray(self.origin_mm + centre @ self.axes)


def lattice_of(
    scene: Scene,
    triangles: Triangles,
    index: int,
    rig: Rig,
    grid: ViewGrid,
    *,
    isotropic: bool = False,
    texture_limit: bool = True,
) -> Lattice:
    """The lattice of one triangle."""
    corners = triangles.p_display[index]
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    area_mm2 = 0.5 * float(np.linalg.norm(normal))
    normal = normal / (2.0 * area_mm2)
    level = np.array([normal[2], 0.0, -normal[0]])  # up × normal
    across = float(np.linalg.norm(level))
    u = level / across if across > 1e-6 else np.array([1.0, 0.0, 0.0])
    axes = np.stack([u, np.cross(normal, u)])

    step_mm = shortest_sides_mm(corners, rig, grid)
    if isotropic:
        step_mm = np.full(2, step_mm.min())
    texels = most_texels(
        scene, scene.materials[int(triangles.material[index])], triangles.texcoords[index]
    )
    if texture_limit and texels > 0.0:
        size_uv = area_mm2 / texels  # equation 2
        step_mm = step_mm * max(1.0, np.sqrt(size_uv / step_mm.prod()))  # equation 3
    flat = (corners - corners[0]) @ axes.T
    low, extent = flat.min(axis=0), np.ptp(flat, axis=0)
    step_mm = np.maximum(np.minimum(step_mm, 1.01 * extent), extent / (MOST_CELLS - 2))
    return Lattice(axes, corners[0] + low @ axes, step_mm, (flat - low) / step_mm)


def shortest_sides_mm(corners: Float64, rig: Rig, grid: ViewGrid) -> Float64:
    """S_ortho's inverse: the shortest column and row, [2] mm, that any eye projects back to the
    triangle where that is closest to it."""
    shortest = np.full(2, np.inf)
    for view, side in enumerate(eye_sides(corners, rig)):
        if side == 0.0:
            continue
        eye = np.array([rig.eye_x_mm[view], 0.0, rig.distance_mm])
        closest = closest_on_triangle(eye, corners)
        shortest = np.minimum(shortest, pixel_sides_mm(corners, closest, rig, grid, view))
    return shortest


def closest_on_triangle(p: Float64, corners: Float64) -> Float64:
    """The point [3] of a triangle that is closest to p: p's foot, or on the closest edge."""
    a, b, c = corners
    normal = np.cross(b - a, c - a)
    foot = p - normal * (np.dot(p - a, normal) / np.dot(normal, normal))
    inside = all(
        np.dot(np.cross(corners[(i + 1) % 3] - corners[i], foot - corners[i]), normal) >= 0.0
        for i in range(3)
    )
    if inside:
        return np.asarray(foot)
    candidates = []
    for i in range(3):
        start, along = corners[i], corners[(i + 1) % 3] - corners[i]
        t = np.clip(np.dot(p - start, along) / np.dot(along, along), 0.0, 1.0)
        candidates.append(start + t * along)
    return np.asarray(min(candidates, key=lambda q: float(np.linalg.norm(p - q))))

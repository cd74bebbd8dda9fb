"""Surfaces as grids: a map from (u, v) to points becomes a mesh of any density.

A closed direction repeats its first line of vertices at its end, with other texture
coordinates and bit-identical positions and normals, so the surface is watertight by position.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lfd_render.scene.model import Mesh

# Takes u [1, columns] and v [rows, 1], both in 0…1 float32, and returns points that broadcast
# to [rows, columns] each.
SurfaceMap = Callable[
    [NDArray[np.float32], NDArray[np.float32]],
    tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]],
]


@dataclass(frozen=True, eq=False)
class Surface:
    """A parametric surface, seen from its front with u to the right and v downwards.

    `size` is its rough extent along u and v, which sets how triangles are shared out;
    `poles` are the v ends (0 and 1) where the whole line is one point; `uv_scale` is how many
    times the texture repeats along u and v (v runs down the texture).
    """

    name: str
    point: SurfaceMap
    size: tuple[float, float]
    material: int
    closed_u: bool = False
    closed_v: bool = False
    poles: bool = False
    uv_scale: tuple[float, float] = (1.0, 1.0)
    detail: float = 1.0  # triangles per area against the other surfaces of the scene
    least: tuple[int, int] = (1, 1)  # cells along u and v below which the shape is lost
    corners: int = 1  # cells along u come in multiples of this, so that corners meet vertices

    def triangles(self, cells: tuple[int, int]) -> int:
        """Triangles of a grid with so many cells along u and v."""
        columns, rows = cells
        return 2 * columns * rows - (2 * columns if self.poles else 0)

    def cells_at(self, density: float) -> tuple[int, int]:
        """Cells along u and v at a density in cells a unit length."""
        scale = density * self.detail**0.5
        columns, rows = (
            max(n, round(s * scale)) for n, s in zip(self.least, self.size, strict=True)
        )
        return -(-columns // self.corners) * self.corners, rows

    def mesh(self, cells: tuple[int, int]) -> Mesh:
        """The surface as a mesh with so many cells along u and v."""
        columns, rows = cells
        u = np.linspace(0.0, 1.0, columns + 1, dtype=np.float32)[None, :]
        v = np.linspace(0.0, 1.0, rows + 1, dtype=np.float32)[:, None]
        positions = np.empty((rows + 1, columns + 1, 3), np.float32)
        for axis, values in enumerate(self.point(u, v)):
            positions[..., axis] = values
        self._close(positions)
        normals = self._normals(positions)
        texcoords = np.zeros((rows + 1, columns + 1, 2, 2), np.float32)
        texcoords[..., 0, 0] = u * self.uv_scale[0]
        texcoords[..., 0, 1] = v * self.uv_scale[1]
        texcoords[..., 1, :] = np.stack(np.broadcast_arrays(u, v), axis=-1)
        count = (rows + 1) * (columns + 1)
        return Mesh(
            name=self.name,
            positions=positions.reshape(count, 3),
            normals=normals.reshape(count, 3),
            texcoords=texcoords.reshape(count, 2, 2),
            colors=np.ones((count, 4), np.float32),
            triangles=_grid_triangles(columns, rows, self.poles),
            material=self.material,
        )

    def _close(self, lines: NDArray[np.float32]) -> None:
        """Make seams and poles of [row, column, xyz] bit-identical."""
        if self.closed_u:
            lines[:, -1] = lines[:, 0]
        if self.closed_v:
            lines[-1] = lines[0]
        if self.poles:
            lines[0] = lines[0, 0]
            lines[-1] = lines[-1, 0]

    def _normals(self, positions: NDArray[np.float32]) -> NDArray[np.float32]:
        """Unit normals from central differences, one-sided at open edges."""
        along_u = _difference(positions, 1, self.closed_u)
        along_v = _difference(positions, 0, self.closed_v)
        normals: NDArray[np.float32] = np.cross(along_v, along_u)
        if self.poles:  # ∂p/∂u vanishes there: take the mean of the next line
            normals[0] = normals[1].sum(axis=0)
            normals[-1] = normals[-2].sum(axis=0)
        self._close(normals)
        length = np.sqrt(np.einsum("yxc,yxc->yx", normals, normals))[..., None]
        np.divide(normals, length, out=normals, where=length > 0.0)
        normals[length[..., 0] == 0.0] = (0.0, 0.0, 1.0)
        return normals


def _difference(lines: NDArray[np.float32], axis: int, closed: bool) -> NDArray[np.float32]:
    """Twice the derivative per cell along an axis of [row, column, xyz]."""
    lines = np.moveaxis(lines, axis, 0)
    out = np.empty_like(lines)
    np.subtract(lines[2:], lines[:-2], out=out[1:-1])
    if closed:  # the last line is the first one again
        out[0] = lines[1] - lines[-2]
        out[-1] = out[0]
    else:
        out[0] = lines[1] - lines[0]
        out[-1] = lines[-1] - lines[-2]
    return np.moveaxis(out, 0, axis)


def _grid_triangles(columns: int, rows: int, poles: bool) -> NDArray[np.uint32]:
    """Two triangles a cell, [m, 3]; one where a pole shrinks the cell's edge to a point."""
    line = columns + 1
    corner = np.arange(rows, dtype=np.uint32)[:, None] * np.uint32(line) + np.arange(
        columns, dtype=np.uint32
    )
    cells = np.empty((rows, columns, 2, 3), np.uint32)
    for slot, offset in enumerate((0, line, 1)):
        cells[..., 0, slot] = corner + np.uint32(offset)
    for slot, offset in enumerate((1, line, line + 1)):
        cells[..., 1, slot] = corner + np.uint32(offset)
    if not poles:
        return cells.reshape(-1, 3)
    # In the first row the edge from 0 to 1 is a point, in the last row the edge opposite.
    return np.concatenate((cells[0, :, 1], cells[1:-1].reshape(-1, 3), cells[-1, :, 0]), axis=0)


def tessellate(surfaces: Sequence[Surface], instances: Sequence[int], triangles: int) -> list[Mesh]:
    """Meshes of all surfaces with about `triangles` in total, counted over instances.

    One density in cells a unit length serves all surfaces; the surface with most triangles
    takes up what rounding leaves over.
    """
    cells = _share_cells(surfaces, instances, triangles)
    return [s.mesh(c) for s, c in zip(surfaces, cells, strict=True)]


def _share_cells(
    surfaces: Sequence[Surface], instances: Sequence[int], triangles: int
) -> list[tuple[int, int]]:
    def total(cells: Sequence[tuple[int, int]]) -> int:
        return sum(n * s.triangles(c) for n, s, c in zip(instances, surfaces, cells, strict=True))

    low, high = 1e-4, 1e6
    for _ in range(80):
        middle = (low * high) ** 0.5
        if total([s.cells_at(middle) for s in surfaces]) > triangles:
            high = middle
        else:
            low = middle
    cells = [s.cells_at(low) for s in surfaces]
    _spend_rest(surfaces, instances, cells, triangles - total(cells))
    return cells


def _spend_rest(
    surfaces: Sequence[Surface],
    instances: Sequence[int],
    cells: list[tuple[int, int]],
    rest: int,
) -> None:
    """Add rows to single-instance surfaces while whole rows fit into the rest."""
    order = sorted(range(len(surfaces)), key=lambda i: cells[i][0], reverse=True)
    for i in order:
        columns, rows = cells[i]
        more = min(max(rest // (2 * columns * instances[i]), 0), rows)
        cells[i] = (columns, rows + more)
        rest -= more * 2 * columns * instances[i]

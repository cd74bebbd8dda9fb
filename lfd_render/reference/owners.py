"""Shading at points: each pixel is coloured as the point that owns it, seen from its view's eye."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import Rig, ViewGrid
from lfd_render.reference.cells import Lattice, closest_on_triangle, lattice_of
from lfd_render.reference.points import row_point_mm
from lfd_render.reference.raster import Pixels, Rays, meet, rays
from lfd_render.reference.transform import Triangles
from lfd_render.scene import Scene

Float64 = NDArray[np.float64]
Int = NDArray[np.int64]


@dataclass(frozen=True)
class Owner:
    """A lattice's points. place: where a point p [3] of a triangle, found on a row, is shaded;
    cell_mm2: the area of a triangle's points, None for points of rows, which grow with depth."""

    place: Callable[[int, int, Float64], Float64]
    cell_mm2: Callable[[int], float] | None = None


def row_owner(
    scene: Scene, triangles: Triangles, rig: Rig, grid: ViewGrid, *, isotropic: bool = False
) -> Owner:
    """Owners of the row lattice: centres of points, within their slices."""

    def place(index: int, row: int, p: Float64) -> Float64:
        return row_point_mm(scene, triangles, index, rig, grid, row=row, p=p, isotropic=isotropic)

    return Owner(place)


def cell_owner(
    scene: Scene, triangles: Triangles, rig: Rig, grid: ViewGrid, *, isotropic: bool = False
) -> Owner:
    """Owners of the paper's lattice: centres of cells, or what of the triangle is closest."""

    @cache
    def lattice(index: int) -> Lattice:
        return lattice_of(scene, triangles, index, rig, grid, isotropic=isotropic)

    def place(index: int, row: int, p: Float64) -> Float64:
        del row
        return closest_on_triangle(lattice(index).centre_mm(p), triangles.p_display[index])

    return Owner(place, lambda index: float(lattice(index).step_mm.prod()))


def owner_rays(
    owner: Owner, triangles: Triangles, rig: Rig, grid: ViewGrid, *, ids: Int, pixels: Pixels
) -> Rays:
    """Rays [pixel] from the pixels' eyes through the points that own them."""
    own = rays(rig, grid, pixels)
    weights = meet(triangles.p_display[ids], own, rig.distance_mm).weights
    hits = np.einsum("nc,ncx->nx", weights, triangles.p_display[ids])
    shaded = np.array(
        [
            owner.place(index, row, p)
            for index, row, p in zip(ids.tolist(), pixels.row.tolist(), hits, strict=True)
        ]
    ).reshape(-1, 3)
    k = rig.distance_mm / (rig.distance_mm - shaded[:, 2])
    return Rays(own.eye_mm, k * shaded[:, 0] + (1.0 - k) * own.eye_mm, k * shaded[:, 1])

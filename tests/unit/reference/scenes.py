"""Small scenes, displays and view grids for the tests of the reference."""

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import Rig, ViewGrid
from lfd_render.reference import Triangles, placed
from lfd_render.scene import Image, Instance, Material, Mesh, Scene

PANEL_MM = (256.0, 128.0)
DISTANCE_MM = 512.0


def views(columns: int = 64, rows: int = 32, eyes: tuple[float, ...] = (-64.0, 0.0, 128.0)):
    """Eyes and a grid over a window of 256 × 128 mm at 512 mm: powers of two, so exact."""
    grid = ViewGrid(
        rows,
        columns,
        PANEL_MM[0] / columns,
        np.full(rows, columns / 2),
        np.zeros(rows, np.int32),
        "upright",
        PANEL_MM,
    )
    return Rig(np.array(eyes), DISTANCE_MM, PANEL_MM, 0.05 * DISTANCE_MM), grid


def mesh_of(
    corners: NDArray[np.floating],
    material: int = 0,
    *,
    texcoords: NDArray[np.floating] | None = None,
    normal: tuple[float, float, float] = (0.0, 0.0, 1.0),
) -> Mesh:
    """Loose triangles [triangle, corner, xyz] of one normal; texcoords: [triangle, corner, uv]."""
    count = 3 * len(corners)
    uv = np.zeros((count, 2)) if texcoords is None else texcoords.reshape(count, 2)
    return Mesh(
        "mesh",
        corners.reshape(count, 3).astype(np.float32),
        np.tile(normal, (count, 1)).astype(np.float32),
        np.repeat(uv[:, None], 2, axis=1).astype(np.float32),
        np.ones((count, 4), np.float32),
        np.arange(count, dtype=np.uint32).reshape(-1, 3),
        material,
    )


def scene_of(
    *meshes: Mesh,
    materials: tuple[Material, ...] = (Material("plain"),),
    images: tuple[Image, ...] = (),
) -> Scene:
    """Meshes that stand where their vertices say."""
    instances = tuple(Instance(str(i), i, np.eye(4)) for i in range(len(meshes)))
    return Scene("test", meshes, instances, materials, images)


def triangles_of(corners: NDArray[np.floating], **options: bool) -> Triangles:
    """Triangles [triangle, corner, xyz] of one plain material."""
    material = Material("plain", **options)  # type: ignore[arg-type]
    return placed(scene_of(mesh_of(corners), materials=(material,)), np.eye(4))


def square(size: float, z: float, centre: tuple[float, float] = (0.0, 0.0)):
    """Two triangles [2, 3, xyz] that face the viewer."""
    x, y = centre
    h = 0.5 * size
    a, b, c, d = ((x - h, y - h, z), (x + h, y - h, z), (x + h, y + h, z), (x - h, y + h, z))
    return np.array([[a, b, c], [a, c, d]])

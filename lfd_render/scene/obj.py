"""Wavefront OBJ files, with their MTL files, as scenes: one mesh a material.

Polygons become fans. Corners without a normal get the mean of the triangles round their
position, weighted by area. Vertex colours are sRGB, as the programs that write them show them.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lfd_render.errors import SceneError
from lfd_render.scene.files import SceneFiles
from lfd_render.scene.images import decode_images
from lfd_render.scene.limits import Budget, LoadLimits
from lfd_render.scene.model import Instance, Material, Mesh, Scene
from lfd_render.scene.mtl import DEFAULT, Palette
from lfd_render.scene.normals import smooth_normals, unit, without_direction
from lfd_render.scene.obj_tables import ObjTables, read_tables

_VERTEX_BYTES, _TRIANGLE_BYTES = 56, 12


def load_obj(path: Path, limits: LoadLimits) -> Scene:
    """Read an OBJ file, and the MTL files and pictures in its folder.

    Raises SceneError or ResourceError with the line, its text and the remedy.
    """
    files, budget = SceneFiles(path, limits), Budget(limits)
    tables = read_tables(files.scene_bytes())
    warnings: dict[str, None] = {}
    palette = _palette(tables, files, warnings)
    corners, triangles, faces = _triangles(tables)
    budget.take("mesh_bytes", _VERTEX_BYTES * len(corners) + _TRIANGLE_BYTES * len(triangles))
    names, material_of_face = _materials_by_face(tables)
    vertices = _Vertices(tables, corners, triangles)
    if vertices.replaced_normals:
        warnings[f"vn: {vertices.replaced_normals} normals without direction replaced"] = None
    material_of_triangle = material_of_face[faces]
    order = np.argsort(material_of_triangle, kind="stable")
    ends = np.cumsum(np.bincount(material_of_triangle, minlength=len(names)))
    meshes: list[Mesh] = []
    materials: list[Material] = []
    for name, chosen in zip(names, np.split(triangles[order], ends[:-1]), strict=True):
        if len(chosen):
            meshes.append(vertices.mesh(name or path.stem, chosen, len(materials)))
            materials.append(DEFAULT if name is None else palette.material(name))
    return Scene(
        name=path.stem,
        meshes=tuple(meshes),
        instances=tuple(Instance(m.name, i, np.eye(4)) for i, m in enumerate(meshes)),
        materials=tuple(materials),
        images=decode_images(palette.requests, budget),
        warnings=tuple(warnings),
    )


def _palette(tables: ObjTables, files: SceneFiles, warnings: dict[str, None]) -> Palette:
    """The materials of the files that mtllib names; a missing one gives a warning."""

    def warn(message: str) -> None:
        warnings[message] = None

    palette = Palette(files, warn)
    for line, keyword, rest in tables.statements:
        if keyword != "mtllib" or not rest:
            continue
        label = f"line {line + 1}: mtllib"
        # Names may hold spaces, and one line may name several files.
        for name in (rest,) if files.has_name(rest, label) else rest.split():
            if files.has_name(name, label):
                palette.read(files.read_name(name, label), name)
            else:
                warn(f"{label}: '{name}' is not there; its materials are drawn in grey")
    return palette


def _triangles(
    tables: ObjTables,
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Distinct corners [n, 3], triangles [m, 3] of them, and the face of each triangle [m]."""
    corners, vertex_of_corner = _distinct(tables.corners)
    sizes = tables.face_sizes
    fans = np.maximum(sizes - 2, 0)
    if not fans.sum():
        raise SceneError("f: no face with three corners; give a file with faces")
    faces = np.repeat(np.arange(len(sizes)), fans)
    hub = np.repeat(np.cumsum(sizes) - sizes, fans)
    step = np.arange(len(faces)) - np.repeat(np.cumsum(fans) - fans, fans)
    triangles = np.stack((hub, hub + step + 1, hub + step + 2), axis=1)
    return corners, vertex_of_corner[triangles], faces


def _distinct(corners: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The distinct rows of [corner, (v, vt, vn)] and which of them each corner is."""
    key = corners[:, 0]
    for column in (1, 2):
        other = corners[:, column]
        if (other == other[:1]).all() or np.array_equal(other, corners[:, 0]):
            continue  # adds nothing to the key
        # Renumbering keeps the product far below 2⁶³.
        key = np.unique(key, return_inverse=True)[1] * (int(other.max()) + 2) + other + 1
    _, first, inverse = np.unique(key, return_index=True, return_inverse=True)
    return corners[first], inverse


def _materials_by_face(tables: ObjTables) -> tuple[list[str | None], NDArray[np.int64]]:
    """Names of the materials, None for faces before any usemtl, and each face's index there."""
    uses = [(line, rest) for line, keyword, rest in tables.statements if keyword == "usemtl"]
    names: list[str | None] = [None]
    order: dict[str, int] = {}
    for _, name in uses:
        if name not in order:
            order[name] = len(names)
            names.append(name)
    of_use = np.array([0, *(order[name] for _, name in uses)])
    lines = np.array([line for line, _ in uses], np.int64)
    return names, of_use[np.searchsorted(lines, tables.face_lines)]


class _Vertices:
    """The attributes of all distinct corners, from which each material takes its own."""

    def __init__(
        self, tables: ObjTables, corners: NDArray[np.int64], triangles: NDArray[np.int64]
    ) -> None:
        v, vt, vn = corners.T
        with_absent = np.vstack((tables.texcoords, (0.0, 1.0)))[vt]  # index −1 is the last row
        self._positions = tables.positions[v].astype(np.float32)
        self._texcoords = np.zeros((len(corners), 2, 2), np.float32)
        self._texcoords[:, 0, 0] = with_absent[:, 0]
        self._texcoords[:, 0, 1] = 1.0 - with_absent[:, 1]  # v runs down the picture here
        self._colors = np.ones((len(corners), 4), np.float32)
        if tables.colors is not None:
            self._colors[:, :3] = _linear(np.clip(tables.colors[v], 0.0, 1.0))
        self.replaced_normals = 0
        self._normals = self._sound_normals(tables, v, vn, triangles)

    def _sound_normals(
        self,
        tables: ObjTables,
        v: NDArray[np.int64],
        vn: NDArray[np.int64],
        triangles: NDArray[np.int64],
    ) -> NDArray[np.float32]:
        """The file's normals, and smooth ones where it has none or they have no direction."""
        given = np.vstack((tables.normals, (0.0, 0.0, 0.0)))[vn].astype(np.float32)
        bad = without_direction(given)
        if not bad.any():
            return unit(given)
        self.replaced_normals = int(np.count_nonzero(bad & (vn >= 0)))
        positions = tables.positions.astype(np.float32)
        place = _welded(positions)  # seams are often written as vertices of their own
        smooth = smooth_normals(positions, place[v[triangles]])
        return unit(np.where(bad[:, None], smooth[place[v]], given))

    def mesh(self, name: str, triangles: NDArray[np.int64], material: int) -> Mesh:
        """The mesh of some of the triangles, with the vertices that they use."""
        used, place = np.unique(triangles, return_inverse=True)
        return Mesh(
            name,
            self._positions[used],
            self._normals[used],
            self._texcoords[used],
            self._colors[used],
            place.reshape(-1, 3).astype(np.uint32),
            material,
        )


def _welded(positions: NDArray[np.float32]) -> NDArray[np.uint32]:
    """For each position, [n], the first that is bit-identical to it (0 and −0 are one)."""
    x, y, z = np.ascontiguousarray(positions.T + np.float32(0.0)).view(np.uint32).astype(np.uint64)
    shift = np.uint64(32)
    _, plane = np.unique(x << shift | y, return_inverse=True)
    _, first, inverse = np.unique(
        plane.astype(np.uint64) << shift | z, return_index=True, return_inverse=True
    )
    return first[inverse].astype(np.uint32)


def _linear(encoded: NDArray[np.float64]) -> NDArray[np.float64]:
    """sRGB values in 0…1 as linear light (IEC 61966-2-1)."""
    low = encoded / 12.92
    high = ((encoded + 0.055) / 1.055) ** 2.4
    return np.where(encoded <= 0.04045, low, high)

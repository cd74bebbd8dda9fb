"""Primitives of a glTF file as meshes: triangles from every mode, attributes, missing normals."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lfd_render.errors import SceneError
from lfd_render.scene.fields import Fields
from lfd_render.scene.gltf_accessors import Accessors
from lfd_render.scene.gltf_document import Document
from lfd_render.scene.gltf_materials import Materials
from lfd_render.scene.gltf_nodes import NodeTree
from lfd_render.scene.gltf_skins import joint_matrices
from lfd_render.scene.gltf_vertices import Vertices
from lfd_render.scene.model import Mesh
from lfd_render.scene.normals import face_normals, smooth_normals, unit, without_direction

_MODES = ("points", "lines", "line loop", "line strip", "triangles", "strip", "fan")
_VERTEX_BYTES, _TRIANGLE_BYTES = 56, 12


class Meshes:
    """Makes each distinct primitive once, however many nodes draw it."""

    def __init__(
        self, document: Document, accessors: Accessors, materials: Materials, tree: NodeTree
    ) -> None:
        self._document = document
        self._accessors = accessors
        self._materials = materials
        self._tree = tree
        self._made: dict[tuple[object, ...], int | None] = {}
        self.meshes: list[Mesh] = []

    def place(self, mesh_index: int, node: Fields) -> list[int]:
        """Positions in the scene of the meshes that a node's mesh turns into."""
        mesh = self._document.meshes[mesh_index]
        primitives = mesh.children("primitives")
        if not primitives:
            mesh.fail("primitives", "give at least one primitive")
        weights = node.all_numbers("weights") or mesh.all_numbers("weights")
        skin = node.index("skin", len(self._document.skins))
        name = mesh.text("name", f"mesh {mesh_index}")
        places: list[int] = []
        for number, primitive in enumerate(primitives):
            key = self._key(primitive, weights, skin)
            if key not in self._made:
                label = name if len(primitives) == 1 else f"{name} {number}"
                self._made[key] = self._make(label, primitive, weights, skin)
            made = self._made[key]
            if made is not None:
                places.append(made)
        return places

    def _key(
        self, primitive: Fields, weights: Sequence[float], skin: int | None
    ) -> tuple[object, ...]:
        """All that decides what a primitive looks like."""
        targets = tuple(self._attributes(t) for t in primitive.children("targets"))
        return (
            self._attributes(primitive.child("attributes")),
            primitive.integer("mode", 4, high=6),
            primitive.index("indices", len(self._document.accessors)),
            primitive.index("material", len(self._document.materials)),
            targets,
            tuple(weights) if targets else (),
            skin,
        )

    def _attributes(self, fields: Fields) -> tuple[tuple[str, int | None], ...]:
        count = len(self._document.accessors)
        return tuple((key, fields.index(key, count)) for key in sorted(fields.keys()))

    def _make(
        self, name: str, primitive: Fields, weights: Sequence[float], skin: int | None
    ) -> int | None:
        """Build one primitive; None, with a warning, where it has no triangles."""
        mode = primitive.integer("mode", 4, high=6)
        if mode < 4:
            self._document.warn(f"{primitive.path}.mode: {_MODES[mode]} are left out")
            return None
        vertices = Vertices(primitive, weights, self._accessors, self._document)
        triangles = self._triangles(primitive, mode, vertices.count)
        if not len(triangles):
            self._document.warn(f"{primitive.path}: has no triangle and is left out")
            return None
        triangles = vertices.keep_used(triangles)
        self._document.budget.take(
            "mesh_bytes", _VERTEX_BYTES * vertices.count + _TRIANGLE_BYTES * len(triangles)
        )
        material = self._materials.place(primitive.index("material", len(self._document.materials)))
        self.meshes.append(self._mesh(name, vertices, triangles, skin, material))
        return len(self.meshes) - 1

    def _triangles(self, primitive: Fields, mode: int, vertex_count: int) -> NDArray[np.uint32]:
        index = primitive.index("indices", len(self._document.accessors))
        if index is None:
            return _to_triangles(np.arange(vertex_count, dtype=np.uint32), mode)
        order = self._accessors.indices(index)
        if int(order.max()) >= vertex_count:
            raise SceneError(
                f"{primitive.path}.indices: index {int(order.max())} out of range; "
                f"the primitive has {vertex_count} vertices"
            )
        if mode == 4 and len(order) % 3:
            self._document.warn(
                f"{primitive.path}.indices: {len(order)} is no multiple of 3; the rest is left out"
            )
        return _to_triangles(order, mode)

    def _mesh(
        self,
        name: str,
        vertices: Vertices,
        triangles: NDArray[np.uint32],
        skin: int | None,
        material: int,
    ) -> Mesh:
        positions = vertices.morphed("POSITION")
        normals = vertices.morphed("NORMAL") if vertices.has("NORMAL") else None
        texcoords, colors = vertices.texcoords(), vertices.colors()
        skinning = None if skin is None else vertices.skinning(self._joint_matrices(skin))
        if skinning is not None:
            positions = skinning.points(positions)
            normals = None if normals is None else skinning.normals(normals)
            triangles = triangles[:, ::-1] if skinning.mirrored else triangles
        if normals is None:  # flat ones (glTF 2.0, section 3.7.2.1), so no vertex is shared
            corners = triangles.ravel()
            normals = np.repeat(unit(face_normals(positions, triangles)), 3, axis=0)
            positions, texcoords, colors = positions[corners], texcoords[corners], colors[corners]
            triangles = np.arange(len(corners), dtype=np.uint32).reshape(-1, 3)
        else:
            normals = self._sound_normals(name, positions, normals, triangles)
        return Mesh(
            name, positions, normals, texcoords, colors, np.ascontiguousarray(triangles), material
        )

    def _joint_matrices(self, skin: int) -> NDArray[np.float64]:
        fields = self._document.skins[skin]
        return joint_matrices(fields, self._document, self._accessors, self._tree)

    def _sound_normals(
        self,
        name: str,
        positions: NDArray[np.float32],
        normals: NDArray[np.float32],
        triangles: NDArray[np.uint32],
    ) -> NDArray[np.float32]:
        """Unit normals; where the file has zero or NaN, the mean of the triangles around."""
        bad = without_direction(normals)
        if not bad.any():
            return unit(normals)
        self._document.warn(f"mesh '{name}': {int(bad.sum())} normals without direction replaced")
        return unit(np.where(bad[:, None], smooth_normals(positions, triangles), normals))


def _to_triangles(order: NDArray[np.uint32], mode: int) -> NDArray[np.uint32]:
    """Triangles [m, 3] of a list (4), strip (5) or fan (6) (glTF 2.0, section 3.7.2.1).

    Strips repeat indices to turn corners; those empty triangles are left out.
    """
    if mode == 4:
        return order[: len(order) // 3 * 3].reshape(-1, 3)
    if len(order) < 3:
        return np.empty((0, 3), np.uint32)
    if mode == 5:
        triangles = np.stack((order[:-2], order[1:-1], order[2:]), axis=1)
        triangles[1::2, 1:] = triangles[1::2, :0:-1]
    else:
        hub = np.full(len(order) - 2, order[0])
        triangles = np.stack((order[1:-1], order[2:], hub), axis=1)
    a, b, c = triangles.T
    kept: NDArray[np.uint32] = triangles[(a != b) & (b != c) & (c != a)]
    return kept

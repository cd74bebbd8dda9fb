"""Primitives of a glTF file as meshes: triangles from every mode, attributes, missing normals,
and what deforms them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lfd_render.errors import SceneError
from lfd_render.scene.deform import Influences, Morph, Skin
from lfd_render.scene.fields import Fields
from lfd_render.scene.gltf_accessors import Accessors
from lfd_render.scene.gltf_document import Document
from lfd_render.scene.gltf_materials import Materials
from lfd_render.scene.gltf_vertices import Vertices
from lfd_render.scene.model import Mesh
from lfd_render.scene.normals import face_normals, smooth_normals, unit, without_direction

_MODES = ("points", "lines", "line loop", "line strip", "triangles", "strip", "fan")
_VERTEX_BYTES, _TRIANGLE_BYTES = 56, 12
_TARGET_BYTES, _INFLUENCE_BYTES = 24, 6  # of a vertex, for each morph target and joint


class Meshes:
    """Makes each distinct primitive once, however many nodes draw it."""

    def __init__(
        self,
        document: Document,
        accessors: Accessors,
        materials: Materials,
        skins: Sequence[Skin],
    ) -> None:
        self._document = document
        self._accessors = accessors
        self._materials = materials
        self._skins = skins
        self._made: dict[tuple[object, ...], int | None] = {}
        self.meshes: list[Mesh] = []

    def place(self, mesh_index: int, node: Fields) -> list[tuple[int, tuple[float, ...]]]:
        """What a node's mesh turns into: positions of meshes in the scene, and morph weights."""
        mesh = self._document.meshes[mesh_index]
        primitives = mesh.children("primitives")
        if not primitives:
            mesh.fail("primitives", "give at least one primitive")
        weights = node.all_numbers("weights") or mesh.all_numbers("weights")
        skin = node.index("skin", len(self._document.skins))
        joints = 0 if skin is None else len(self._skins[skin].joints)
        name = mesh.text("name", f"mesh {mesh_index}")
        places: list[tuple[int, tuple[float, ...]]] = []
        for number, primitive in enumerate(primitives):
            key = self._key(primitive, joints)
            if key not in self._made:
                label = name if len(primitives) == 1 else f"{name} {number}"
                self._made[key] = self._make(label, primitive, joints)
            made = self._made[key]
            if made is not None:
                places.append((made, self._weights(primitive, self.meshes[made], weights)))
        return places

    def _weights(
        self, primitive: Fields, mesh: Mesh, weights: tuple[float, ...]
    ) -> tuple[float, ...]:
        """Weights of a mesh's morph targets at rest; none at all stands for zeros."""
        count = mesh.target_count
        if count and any(weights) and len(weights) != count:
            raise SceneError(
                f"{primitive.path}.targets: {count} targets and {len(weights)} weights; "
                "give as many weights as targets"
            )
        return weights if len(weights) == count else (0.0,) * count

    def _key(self, primitive: Fields, joints: int) -> tuple[object, ...]:
        """All that decides what a primitive looks like, but for its pose."""
        return (
            self._attributes(primitive.child("attributes")),
            primitive.integer("mode", 4, high=6),
            primitive.index("indices", len(self._document.accessors)),
            primitive.index("material", len(self._document.materials)),
            tuple(self._attributes(t) for t in primitive.children("targets")),
            joints,
        )

    def _attributes(self, fields: Fields) -> tuple[tuple[str, int | None], ...]:
        count = len(self._document.accessors)
        return tuple((key, fields.index(key, count)) for key in sorted(fields.keys()))

    def _make(self, name: str, primitive: Fields, joints: int) -> int | None:
        """Build one primitive, for a skin of so many joints or none; None, with a warning, where it
        has no triangles."""
        mode = primitive.integer("mode", 4, high=6)
        if mode < 4:
            self._document.warn(f"{primitive.path}.mode: {_MODES[mode]} are left out")
            return None
        vertices = Vertices(primitive, self._accessors, self._document)
        triangles = self._triangles(primitive, mode, vertices.count)
        if not len(triangles):
            self._document.warn(f"{primitive.path}: has no triangle and is left out")
            return None
        triangles = vertices.keep_used(triangles)
        moving = _TARGET_BYTES * vertices.target_count + (_INFLUENCE_BYTES * 4 if joints else 0)
        count = vertices.count if vertices.has("NORMAL") else 3 * len(triangles)
        self._document.budget.take(
            "mesh_bytes", (_VERTEX_BYTES + moving) * count + _TRIANGLE_BYTES * len(triangles)
        )
        material = self._materials.place(primitive.index("material", len(self._document.materials)))
        self.meshes.append(self._mesh(name, vertices, triangles, joints, material))
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
        joints: int,
        material: int,
    ) -> Mesh:
        positions = vertices.vectors("POSITION")
        texcoords, colors = vertices.texcoords(), vertices.colors()
        morph = vertices.morph()
        influences = vertices.influences(joints) if joints else None
        flat = not vertices.has("NORMAL")
        if flat:  # flat normals (glTF 2.0, section 3.7.2.1), so no vertex is shared
            corners = triangles.ravel()
            normals = np.repeat(unit(face_normals(positions, triangles)), 3, axis=0)
            positions, texcoords, colors = positions[corners], texcoords[corners], colors[corners]
            morph, influences = _picked(morph, influences, corners)
            triangles = np.arange(len(corners), dtype=np.uint32).reshape(-1, 3)
        else:
            normals = self._sound_normals(name, positions, vertices.vectors("NORMAL"), triangles)
        return Mesh(
            name, positions, normals, texcoords, colors, np.ascontiguousarray(triangles), material,
            morph, influences, flat,
        )  # fmt: skip

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


def _picked(
    morph: Morph | None, influences: Influences | None, used: NDArray[np.uint32]
) -> tuple[Morph | None, Influences | None]:
    """What deforms some of the vertices."""
    return (
        morph and Morph(morph.positions[:, used], morph.normals[:, used]),
        influences and Influences(influences.joints[used], influences.weights[used]),
    )


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

"""Skins and morph targets in their rest pose, applied to the vertices of one primitive."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lfd_render.scene.fields import Fields
from lfd_render.scene.gltf_accessors import Accessors
from lfd_render.scene.gltf_document import Document
from lfd_render.scene.gltf_nodes import NodeTree
from lfd_render.scene.normals import unit

Vectors = NDArray[np.float32]


def joint_matrices(
    skin: Fields, document: Document, accessors: Accessors, tree: NodeTree
) -> NDArray[np.float64]:
    """`world_from_bind` of each joint of a skin, [joint, 4, 4] (glTF 2.0, section 3.7.3.3)."""
    joints = skin.indices("joints", len(document.nodes))
    if not joints:
        skin.fail("joints", "give at least one joint")
    world = np.stack([tree.world_from_node[j] for j in joints])
    index = skin.index("inverseBindMatrices", len(document.accessors))
    if index is None:
        return world
    joint_from_bind = accessors.floats(index, ("MAT4",)).astype(np.float64)
    if len(joint_from_bind) < len(joints):
        skin.fail("inverseBindMatrices", f"give {len(joints)} matrices, one a joint")
    # The file stores columns one after the other.
    columns = joint_from_bind[: len(joints)].reshape(-1, 4, 4)
    return world @ columns.transpose(0, 2, 1)


class Skinning:
    """The blended joint matrix of each vertex, `world_from_bind` [n, 3, 4] float64."""

    def __init__(
        self, matrices: NDArray[np.float64], joints: NDArray[np.int64], weights: Vectors
    ) -> None:
        """Joints [n, k] index matrices; weights [n, k] are scaled to a sum of one."""
        shares = weights.astype(np.float64)
        total = shares.sum(axis=1, keepdims=True)
        # A vertex without weights follows the first joint it names.
        shares[total[:, 0] <= 0.0, 0] = 1.0
        total[total <= 0.0] = 1.0
        shares /= total
        self._world_from_bind = np.zeros((len(joints), 3, 4))
        for column in range(joints.shape[1]):
            picked = matrices[joints[:, column], :3]
            self._world_from_bind += shares[:, column, None, None] * picked

    @property
    def mirrored(self) -> bool:
        """Whether most vertices are mirrored, so that triangles must be turned round."""
        return bool(np.median(np.linalg.det(self._world_from_bind[:, :, :3])) < 0.0)

    def points(self, p_bind: Vectors) -> Vectors:
        """Points [n, 3] in world space."""
        linear, offset = self._world_from_bind[:, :, :3], self._world_from_bind[:, :, 3]
        p_world: Vectors = (np.einsum("nij,nj->ni", linear, p_bind) + offset).astype(np.float32)
        return p_world

    def normals(self, normals: Vectors) -> Vectors:
        """Normals [n, 3] turned by the inverse transpose, of unit length."""
        a, b, c = (self._world_from_bind[:, :, i] for i in range(3))
        cofactor = np.stack((np.cross(b, c), np.cross(c, a), np.cross(a, b)), axis=2)
        sign = np.where(np.einsum("ni,ni->n", a, cofactor[:, :, 0]) < 0.0, -1.0, 1.0)
        return unit(np.einsum("nij,nj->ni", cofactor, normals) * sign[:, None])


def morph(base: Vectors, deltas: Sequence[Vectors], weights: Sequence[float]) -> Vectors:
    """`base` plus the weighted displacements of its morph targets."""
    active = [(d, w) for d, w in zip(deltas, weights, strict=True) if w != 0.0]
    if not active:
        return base
    total = base.astype(np.float64)
    for delta, weight in active:
        total += delta.astype(np.float64) * weight
    return total.astype(np.float32)

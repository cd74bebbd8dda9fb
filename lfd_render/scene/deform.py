"""What moves the vertices of a mesh beside its placement, skins and morph targets, and how.

glTF 2.0, sections 3.7.2.2 and 3.7.3.3: first the morph targets, then the skin.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lfd_render.errors import SceneError
from lfd_render.scene.checks import freeze
from lfd_render.scene.normals import face_normals, unit

if TYPE_CHECKING:
    from lfd_render.scene.model import Mesh

MOST_TARGETS = 1 << 15  # software devices end a vertex's loops after 65,535 rounds
Float64 = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Skin:
    """Joints, int64 [joint], as nodes, and joint_from_bind, float64 [joint, 4, 4]: the inverse
    bind matrices."""

    name: str
    joints: NDArray[np.int64]
    joint_from_bind: Float64

    def __post_init__(self) -> None:
        """Check the arrays against each other."""
        label = f"skin '{self.name}'"
        freeze(self, label, "joints", np.int64, (None,))
        freeze(self, label, "joint_from_bind", np.float64, (len(self.joints), 4, 4))
        if not len(self.joints):
            raise SceneError(f"{label}: joints: none; give at least one joint")


@dataclass(frozen=True, eq=False)
class Influences:
    """Which joints of a skin move a vertex, and how much. joints: uint16 [n, k], positions in the
    skin's list; weights: float32 [n, k], of sum 1; k a multiple of 4."""

    joints: NDArray[np.uint16]
    weights: NDArray[np.float32]

    def __post_init__(self) -> None:
        """Check the arrays against each other."""
        freeze(self, "influences", "joints", np.uint16, (None, None))
        freeze(self, "influences", "weights", np.float32, self.joints.shape)
        if not self.joints.shape[1] or self.joints.shape[1] % 4:
            raise SceneError(
                f"influences: joints: {self.joints.shape[1]} a vertex; give 4, or a multiple of 4"
            )
        off = np.abs(self.weights.sum(axis=1, dtype=np.float64) - 1.0) > 1e-3
        if off.any():
            row = int(np.argmax(off))
            raise SceneError(
                f"influences: weights[{row}]: {self.weights[row].tolist()}; give weights of sum 1"
            )

    @staticmethod
    def scaled(joints: NDArray[np.integer], weights: NDArray[np.floating]) -> Influences:
        """Influences whose weights are scaled to a sum of one; a vertex without weights follows
        the first joint it names."""
        shares = weights.astype(np.float64)
        total = shares.sum(axis=1, keepdims=True)
        lost = total[:, 0] <= 0.0
        shares[lost] = 0.0
        shares[lost, 0] = 1.0
        total[lost] = 1.0
        return Influences(joints.astype(np.uint16), (shares / total).astype(np.float32))

    @cached_property
    def joint_shares(self) -> Float64:
        """How much of the mesh follows each joint, in vertices: float64 [joint named]."""
        weights = self.weights.ravel().astype(np.float64)
        return np.bincount(self.joints.ravel(), weights).astype(np.float64)


@dataclass(frozen=True, eq=False)
class Morph:
    """Displacements at weight 1: positions and normals, float32 [target, n, 3]."""

    positions: NDArray[np.float32]
    normals: NDArray[np.float32]

    def __post_init__(self) -> None:
        """Check the arrays against each other."""
        freeze(self, "morph", "positions", np.float32, (None, None, 3))
        freeze(self, "morph", "normals", np.float32, self.positions.shape)
        if not 0 < len(self.positions) <= MOST_TARGETS:
            raise SceneError(
                f"morph: {len(self.positions)} targets; give 1 to {MOST_TARGETS} of them"
            )


def deformed(
    mesh: Mesh, weights: Sequence[float] | Float64, world_from_bind: Float64 | None
) -> tuple[Float64, Float64]:
    """Positions and unit normals, float64 [n, 3], of a mesh's vertices: morphed by weights
    [target], then, unless None, skinned by world_from_bind [joint, 4, 4]. Flat normals are those
    of the mesh's triangles as they now lie, counter-clockwise the front.
    """
    positions, normals = mesh.positions.astype(np.float64), mesh.normals.astype(np.float64)
    if mesh.morph is not None:
        for target, weight in enumerate(weights):
            if weight:
                positions += float(weight) * mesh.morph.positions[target].astype(np.float64)
                normals += float(weight) * mesh.morph.normals[target].astype(np.float64)
    if world_from_bind is not None:
        assert mesh.influences is not None
        blended = _blended(mesh.influences, world_from_bind)
        linear, offset = blended[:, :, :3], blended[:, :, 3]
        positions = np.einsum("nij,nj->ni", linear, positions) + offset
        normals = _turned(linear, normals)
    if mesh.flat:
        normals = np.repeat(face_normals(positions, mesh.triangles), 3, axis=0)
    return positions, unit(normals).astype(np.float64)


def _blended(influences: Influences, matrices: Float64) -> Float64:
    """Each vertex's own matrix, [n, 3, 4]."""
    blended = np.zeros((len(influences.joints), 3, 4))
    for column in range(influences.joints.shape[1]):
        share = influences.weights[:, column, None, None].astype(np.float64)
        blended += share * matrices[influences.joints[:, column], :3]
    return blended


def _turned(linear: Float64, normals: Float64) -> Float64:
    """Normals by the inverse transpose times |determinant|, which flattened matrices have too."""
    # Scaled first, so that products neither overflow nor vanish.
    scaled = linear / np.maximum(np.abs(linear).max(axis=(1, 2), keepdims=True), 1e-300)
    a, b, c = (scaled[:, :, i] for i in range(3))
    cofactors = np.stack((np.cross(b, c), np.cross(c, a), np.cross(a, b)), axis=2)
    sign = np.where(np.einsum("ni,ni->n", a, cofactors[:, :, 0]) < 0.0, -1.0, 1.0)
    turned: Float64 = np.einsum("nij,nj->ni", cofactors, normals) * sign[:, None]
    return turned

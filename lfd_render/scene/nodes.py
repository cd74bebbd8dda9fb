"""The node tree that places meshes, joints, lights and cameras, and the transforms of its nodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from lfd_render.errors import SceneError
from lfd_render.scene.checks import freeze

NO_PARENT = -1


def _no_matrices() -> NDArray[np.float64]:
    return np.empty((0, 4, 4))


def _no_parents() -> NDArray[np.int64]:
    return np.empty(0, np.int64)


@dataclass(frozen=True, eq=False)
class Nodes:
    """Nodes at rest. parents: int64 [node], NO_PARENT for roots; parent_from_node: float64
    [node, 4, 4], affine. Names may repeat."""

    names: tuple[str, ...] = ()
    parents: NDArray[np.int64] = field(default_factory=_no_parents)
    parent_from_node: NDArray[np.float64] = field(default_factory=_no_matrices)

    def __post_init__(self) -> None:
        """Check that the nodes are trees, and their matrices."""
        count = len(self.names)
        freeze(self, "nodes", "parents", np.int64, (count,))
        freeze(self, "nodes", "parent_from_node", np.float64, (count, 4, 4))
        bad = np.flatnonzero((self.parents < NO_PARENT) | (self.parents >= count))
        if len(bad):
            raise SceneError(
                f"nodes: parents[{bad[0]}]: {self.parents[bad[0]]}; give a node from 0 to "
                f"{count - 1}, or {NO_PARENT} for a root"
            )
        bad = np.flatnonzero((self.parent_from_node[:, 3] != (0.0, 0.0, 0.0, 1.0)).any(axis=1))
        if len(bad):
            raise SceneError(
                f"nodes: parent_from_node[{bad[0]}]: last row "
                f"{self.parent_from_node[bad[0], 3].tolist()}; give 0 0 0 1"
            )
        if sum(map(len, self._levels)) < count:
            reached = np.zeros(count, bool)
            for level in self._levels:
                reached[level] = True
            raise SceneError(
                f"nodes: parents[{int(np.argmin(reached))}]: the node is its own ancestor or "
                "descends from such a cycle; give the nodes as trees"
            )

    def __len__(self) -> int:
        return len(self.names)

    @cached_property
    def _levels(self) -> list[NDArray[np.int64]]:
        """Nodes by how many ancestors they have, roots first."""
        children: list[list[int]] = [[] for _ in self.names]
        for node, parent in enumerate(self.parents.tolist()):
            if parent != NO_PARENT:
                children[parent].append(node)
        levels = []
        level = np.flatnonzero(self.parents == NO_PARENT).tolist()
        while level:
            levels.append(np.array(level, np.int64))
            level = [child for node in level for child in children[node]]
        return levels

    @cached_property
    def places(self) -> dict[str, list[int]]:
        """The nodes of each name."""
        places: dict[str, list[int]] = {}
        for node, name in enumerate(self.names):
            places.setdefault(name, []).append(node)
        return places

    def world(self, parent_from_node: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """world_from_node, float64 [node, 4, 4], at rest or by other matrices of the same shape.

        What overflows is not finite.
        """
        local = self.parent_from_node if parent_from_node is None else parent_from_node
        world = np.array(local)
        with np.errstate(over="ignore", invalid="ignore"):
            for level in self._levels[1:]:
                world[level] = world[self.parents[level]] @ local[level]
        return world


def node_transform(
    translation: Sequence[float] = (0.0, 0.0, 0.0),
    rotation: Sequence[float] = (0.0, 0.0, 0.0, 1.0),
    scale: Sequence[float] = (1.0, 1.0, 1.0),
) -> NDArray[np.float64]:
    """`parent_from_node`, float64 [4, 4], as glTF composes it: translation · rotation · scale.

    rotation: a quaternion x, y, z, w of any length but 0. Raises SceneError.
    """
    quaternion = np.array(rotation, np.float64)
    length = float(np.linalg.norm(quaternion)) if quaternion.shape == (4,) else np.nan
    if not 0.0 < length < np.inf:
        raise SceneError(f"rotation: {list(rotation)}; give a unit quaternion x y z w")
    x, y, z, w = quaternion / length
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    matrix = np.eye(4)
    matrix[:3, :3] = turn * np.array(scale, np.float64)
    matrix[:3, 3] = translation
    return matrix


def handedness(matrices: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of placements [n, 4, 4]: −1 where one mirrors, 0 where it flattens, else 1."""
    linear = matrices[:, :3, :3]
    # Scaled first, so that determinants neither overflow nor vanish.
    scale = np.maximum(np.abs(linear).max(axis=(1, 2), keepdims=True), 1e-300)
    return np.asarray(np.sign(np.linalg.det(linear / scale)))

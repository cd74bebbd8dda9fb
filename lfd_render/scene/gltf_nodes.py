"""The node tree of a glTF file: world transforms of all nodes, what the scene draws, cameras."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lfd_render.errors import ResourceError, SceneError
from lfd_render.scene.fields import Fields
from lfd_render.scene.gltf_document import Document
from lfd_render.scene.model import SceneCamera

Matrix = NDArray[np.float64]


class NodeTree:
    """Parents, transforms and the drawn nodes; cycles and second parents are refused."""

    def __init__(self, document: Document) -> None:
        self._document = document
        limit = document.budget.limits.nodes
        if len(document.nodes) > limit:
            raise ResourceError(f"nodes: {len(document.nodes)}; the limit is {limit}")
        count = len(document.nodes)
        self._children = [n.indices("children", count) for n in document.nodes]
        self._parents = self._find_parents()
        self.world_from_node = self._transforms()

    def drawn(self) -> list[int]:
        """Nodes of the default scene, parents before children, in the file's order."""
        order: list[int] = []
        stack = self._roots()[::-1]
        while stack:
            node = stack.pop()
            order.append(node)
            stack.extend(reversed(self._children[node]))
        return order

    def _find_parents(self) -> list[int | None]:
        parents: list[int | None] = [None] * len(self._children)
        for node, children in enumerate(self._children):
            for child in children:
                if parents[child] is not None:
                    raise SceneError(
                        f"nodes[{node}].children: node {child} is already a child of node "
                        f"{parents[child]}; give each node one parent"
                    )
                parents[child] = node
        return parents

    def _transforms(self) -> list[Matrix]:
        """World transform of each node; a node that no root leads to is part of a cycle."""
        world: list[Matrix | None] = [None] * len(self._children)
        stack = [i for i, parent in enumerate(self._parents) if parent is None]
        while stack:
            node = stack.pop()
            matrix = local_transform(self._document.nodes[node])
            parent = self._parents[node]
            above = None if parent is None else world[parent]
            matrix = matrix if above is None else above @ matrix
            if not np.isfinite(matrix).all():
                raise SceneError(f"nodes[{node}]: its world transform overflows; scale it down")
            world[node] = matrix
            stack.extend(self._children[node])
        done = [w for w in world if w is not None]
        if len(done) < len(world):
            bad = next(i for i, w in enumerate(world) if w is None)
            raise SceneError(
                f"nodes[{bad}].children: node {bad} is its own ancestor or descends from such a "
                "cycle; give the nodes as a tree"
            )
        return done

    def _roots(self) -> list[int]:
        """Roots of the file's default scene; of all nodes where it has no scenes."""
        scenes = self._document.root.children("scenes")
        chosen = self._document.root.index("scene", len(scenes)) or 0
        if not scenes:
            return [i for i, parent in enumerate(self._parents) if parent is None]
        scene = scenes[chosen]
        roots = scene.indices("nodes", len(self._children))
        for root in roots:
            if self._parents[root] is not None:
                raise SceneError(
                    f"{scene.path}.nodes: node {root} is a child of node {self._parents[root]}; "
                    "list root nodes only"
                )
        if len(set(roots)) < len(roots):
            raise SceneError(f"{scene.path}.nodes: a node stands twice; list each root once")
        return roots

    def cameras(self) -> tuple[SceneCamera, ...]:
        """Perspective cameras of the drawn nodes; orthographic ones give a warning."""
        cameras: list[SceneCamera] = []
        for node in self.drawn():
            fields = self._document.nodes[node]
            index = fields.index("camera", len(self._document.cameras))
            if index is None:
                continue
            camera = self._document.cameras[index]
            if camera.choice("type", ("perspective", "orthographic")) == "orthographic":
                self._document.warn(f"{camera.path}: orthographic cameras are left out")
                continue
            name = camera.text("name", fields.text("name", f"camera {index}"))
            yfov_rad = camera.child("perspective").number("yfov", low=1e-6, high=math.pi - 1e-6)
            cameras.append(SceneCamera(name, self.world_from_node[node], yfov_rad))
        return tuple(cameras)


def local_transform(fields: Fields) -> Matrix:
    """`parent_from_node` of a node: its matrix, or translation · rotation · scale."""
    if "matrix" in fields:
        matrix = np.array(fields.numbers("matrix", np.eye(4).ravel().tolist())).reshape(4, 4).T
        if not np.array_equal(matrix[3], (0.0, 0.0, 0.0, 1.0)):
            fields.fail("matrix", "give an affine matrix: entries 4, 8, 12 are 0 and 16 is 1")
        return matrix
    matrix = np.eye(4)
    matrix[:3, :3] = _rotation(fields) * fields.numbers("scale", (1.0, 1.0, 1.0))
    matrix[:3, 3] = fields.numbers("translation", (0.0, 0.0, 0.0))
    return matrix


def _rotation(fields: Fields) -> Matrix:
    """Rotation matrix [3, 3] of the unit quaternion (x, y, z, w); any length but 0 is accepted."""
    quaternion = np.array(fields.numbers("rotation", (0.0, 0.0, 0.0, 1.0)))
    length = float(np.linalg.norm(quaternion))
    if not 0.0 < length < math.inf:
        fields.fail("rotation", "give a unit quaternion x y z w")
    x, y, z, w = quaternion / length
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )

"""The node tree of a glTF file: world transforms of all nodes, what the scene draws, cameras."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lfd_render.errors import ResourceError, SceneError
from lfd_render.scene.fields import Fields
from lfd_render.scene.gltf_document import Document
from lfd_render.scene.model import SceneCamera
from lfd_render.scene.nodes import NO_PARENT, Nodes, node_transform

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
        self._refuse_cycles()
        self.nodes = Nodes(
            tuple(n.text("name", f"node {i}") for i, n in enumerate(document.nodes)),
            np.array([NO_PARENT if p is None else p for p in self._parents], np.int64),
            np.array([local_transform(n) for n in document.nodes]).reshape(-1, 4, 4),
        )
        self.world_from_node = self.nodes.world()
        bad = np.flatnonzero(~np.isfinite(self.world_from_node).all(axis=(1, 2)))
        if len(bad):
            raise SceneError(f"nodes[{bad[0]}]: its world transform overflows; scale it down")

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

    def _refuse_cycles(self) -> None:
        """A node that no root leads to is part of a cycle."""
        reached = np.zeros(len(self._children), bool)
        stack = [i for i, parent in enumerate(self._parents) if parent is None]
        while stack:
            node = stack.pop()
            reached[node] = True
            stack.extend(self._children[node])
        if not reached.all():
            bad = int(np.argmin(reached))
            raise SceneError(
                f"nodes[{bad}].children: node {bad} is its own ancestor or descends from such a "
                "cycle; give the nodes as a tree"
            )

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
            cameras.append(SceneCamera(name, self.world_from_node[node], yfov_rad, node))
        return tuple(cameras)


def local_transform(fields: Fields) -> Matrix:
    """`parent_from_node` of a node: its matrix, or translation · rotation · scale."""
    if "matrix" in fields:
        matrix = np.array(fields.numbers("matrix", np.eye(4).ravel().tolist())).reshape(4, 4).T
        if not np.array_equal(matrix[3], (0.0, 0.0, 0.0, 1.0)):
            fields.fail("matrix", "give an affine matrix: entries 4, 8, 12 are 0 and 16 is 1")
        return matrix
    rotation = fields.numbers("rotation", (0.0, 0.0, 0.0, 1.0))
    if not 0.0 < float(np.linalg.norm(rotation)) < math.inf:
        fields.fail("rotation", "give a unit quaternion x y z w")
    return node_transform(
        fields.numbers("translation", (0.0, 0.0, 0.0)),
        rotation,
        fields.numbers("scale", (1.0, 1.0, 1.0)),
    )

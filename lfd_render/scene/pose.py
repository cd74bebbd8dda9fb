"""A pose: which nodes of a scene stand otherwise than at rest; and where everything then stands."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfd_render.errors import SceneError
from lfd_render.scene.deform import deformed
from lfd_render.scene.model import Instance, Mesh, Scene
from lfd_render.scene.nodes import handedness

Float64 = NDArray[np.float64]
Node = int | str

NO_JOINTS = -1


@dataclass(frozen=True, eq=False)
class Pose:
    """What differs from rest, by a node's index or, where no other has it, its name.

    transforms: parent_from_node, [4, 4] and affine (`node_transform` makes them from translation,
    rotation and scale); they replace the node's own. weights: of the morph targets of the mesh
    that the node draws. Whatever is not named stands as at rest. Raises SceneError.
    """

    transforms: Mapping[Node, NDArray[np.float64]] = field(default_factory=dict)
    weights: Mapping[Node, Sequence[float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check the numbers and keep copies of them."""
        transforms = {k: _numbers(k, "transform", v) for k, v in _items(self, "transforms")}
        for node, matrix in transforms.items():
            if matrix.shape != (4, 4) or not np.array_equal(matrix[3], (0.0, 0.0, 0.0, 1.0)):
                raise SceneError(
                    f"pose: transform of node {node!r}: {matrix.tolist()}; give a [4, 4] matrix "
                    "whose last row is 0 0 0 1"
                )
        weights = {k: _numbers(k, "weights", v) for k, v in _items(self, "weights")}
        for node, row in weights.items():
            if row.ndim != 1:
                raise SceneError(
                    f"pose: weights of node {node!r}: {row.tolist()}; give one number a target"
                )
        object.__setattr__(self, "transforms", MappingProxyType(transforms))
        object.__setattr__(self, "weights", MappingProxyType(weights))


@dataclass(frozen=True, eq=False)
class Posed:
    """Where the things of a scene stand, in their order. All float64 but `mirrored`.

    world_from_instance: [instance, 4, 4], the identity for skinned ones; mirrored: bool [instance],
    whether most of what the skin moves is mirrored; world_from_bind: [joint, 4, 4], all skins' one
    after the other; weights: [morph weight], all instances' one after the other; world_from_light,
    world_from_camera: […, 4, 4].
    """

    world_from_instance: Float64
    mirrored: NDArray[np.bool_]
    world_from_bind: Float64
    weights: Float64
    world_from_light: Float64
    world_from_camera: Float64


class _Carried:
    """Matrices of things that hang on nodes, and of things that hang on none."""

    def __init__(self, at_rest: Sequence[Float64], nodes: Sequence[int | None]) -> None:
        self._at_rest = np.array(at_rest, np.float64).reshape(-1, 4, 4)
        self._moving = np.flatnonzero([node is not None for node in nodes])
        self._nodes = np.array([node for node in nodes if node is not None], np.int64)

    def __call__(self, world_from_node: Float64) -> Float64:
        matrices = self._at_rest.copy()
        matrices[self._moving] = world_from_node[self._nodes]
        return matrices


class Poser:
    """Scene, Pose → Posed. first_joint, first_weight: int64 [instance], where an instance's joints
    and weights start in `Posed`; NO_JOINTS without a skin."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        starts = np.cumsum([0, *(len(skin.joints) for skin in scene.skins)])
        self.first_joint = np.array(
            [NO_JOINTS if i.skin is None else starts[i.skin] for i in scene.instances], np.int64
        )
        ends = np.cumsum([0, *(len(i.weights) for i in scene.instances)])
        self.first_weight = ends[:-1].astype(np.int64)
        self._joints = np.concatenate([np.empty(0, np.int64), *(s.joints for s in scene.skins)])
        self._joint_from_bind = np.concatenate(
            [np.empty((0, 4, 4)), *(s.joint_from_bind for s in scene.skins)]
        )
        self._weights = np.array([w for i in scene.instances for w in i.weights], np.float64)
        self._weighted: dict[int, list[int]] = {}  # node → instances with morph targets
        for index, instance in enumerate(scene.instances):
            if instance.node is not None and instance.weights:
                self._weighted.setdefault(instance.node, []).append(index)
        self._skinned = np.flatnonzero(self.first_joint != NO_JOINTS).tolist()
        placed = [None if i.skin is not None else i.node for i in scene.instances]
        at_rest = [np.eye(4) if i.skin is not None else i.world_from_local for i in scene.instances]
        self._instances = _Carried(at_rest, placed)
        lights, cameras = scene.lights, scene.cameras
        self._lights = _Carried([x.world_from_light for x in lights], [x.node for x in lights])
        self._cameras = _Carried([x.world_from_camera for x in cameras], [x.node for x in cameras])

    def __call__(self, pose: Pose | None = None) -> Posed:
        """Where things stand, by default at rest. Raises SceneError if the pose does not fit."""
        scene, pose = self._scene, pose or Pose()
        world = scene.nodes.world(self._transforms(pose))
        bad = np.flatnonzero(~np.isfinite(world).all(axis=(1, 2)))
        if len(bad):
            raise SceneError(
                f"pose: node {bad[0]} '{scene.nodes.names[bad[0]]}': its world transform "
                "overflows; scale it down"
            )
        with np.errstate(over="ignore", invalid="ignore"):
            world_from_bind = world[self._joints] @ self._joint_from_bind
        bad = np.flatnonzero(~np.isfinite(world_from_bind).all(axis=(1, 2)))
        if len(bad):
            raise SceneError(
                f"pose: node {self._joints[bad[0]]} '{scene.nodes.names[self._joints[bad[0]]]}': "
                "what it moves as a joint overflows; scale it, or its inverse bind matrix, down"
            )
        return Posed(
            world_from_instance=self._instances(world),
            mirrored=self._mirrored(world_from_bind),
            world_from_bind=world_from_bind,
            weights=self._posed_weights(pose),
            world_from_light=self._lights(world),
            world_from_camera=self._cameras(world),
        )

    def scene(self, pose: Pose | None = None) -> Scene:
        """What `Scene.posed` gives."""
        scene, posed = self._scene, self(pose)
        meshes, instances = list(scene.meshes), []
        for index, instance in enumerate(scene.instances):
            mesh = instance.mesh
            if scene.deforms(instance):
                mesh = len(meshes)
                meshes.append(self._mesh(index, posed))
            instances.append(Instance(instance.name, mesh, posed.world_from_instance[index]))
        return replace(
            scene,
            meshes=tuple(
                replace(m, morph=None, influences=None) if m.morph or m.influences else m
                for m in meshes
            ),
            instances=tuple(instances),
            lights=tuple(
                replace(light, world_from_light=matrix, node=None)
                for light, matrix in zip(scene.lights, posed.world_from_light, strict=True)
            ),
            cameras=tuple(
                replace(camera, world_from_camera=matrix, node=None)
                for camera, matrix in zip(scene.cameras, posed.world_from_camera, strict=True)
            ),
            nodes=type(scene.nodes)(),
            skins=(),
        )

    def vertices(self, index: int, posed: Posed) -> tuple[Float64, Float64]:
        """Positions and unit normals, float64 [n, 3], of an instance's mesh as it lies before its
        matrix in `posed`."""
        instance = self._scene.instances[index]
        mesh = self._scene.meshes[instance.mesh]
        first = self.first_weight[index]
        weights = posed.weights[first : first + len(instance.weights)]
        matrices = None
        if instance.skin is not None:
            matrices = posed.world_from_bind[self.first_joint[index] :]
        positions, normals = deformed(mesh, weights, matrices)
        return positions, -normals if mesh.flat and posed.mirrored[index] else normals

    def _mesh(self, index: int, posed: Posed) -> Mesh:
        """The mesh of an instance as it lies, its triangles turned round where the skin mirrors."""
        mesh = self._scene.meshes[self._scene.instances[index].mesh]
        positions, normals = self.vertices(index, posed)
        mirrored = bool(posed.mirrored[index])
        return replace(
            mesh,
            positions=positions.astype(np.float32),
            normals=normals.astype(np.float32),
            triangles=np.ascontiguousarray(mesh.triangles[:, ::-1]) if mirrored else mesh.triangles,
            flat=False,
            morph=None,
            influences=None,
        )

    def _transforms(self, pose: Pose) -> Float64:
        local = self._scene.nodes.parent_from_node.copy()
        for node, (_, matrix) in self._by_node("transform", pose.transforms).items():
            local[node] = matrix
        return local

    def _posed_weights(self, pose: Pose) -> Float64:
        weights = self._weights.copy()
        for node, (key, row) in self._by_node("weights", pose.weights).items():
            instances = self._weighted.get(node, [])
            if not instances:
                raise SceneError(
                    f"pose: weights of node {key!r}: it draws no mesh with morph targets; "
                    f"those that do are {sorted(self._weighted)}"
                )
            for index in instances:
                count = len(self._scene.instances[index].weights)
                if len(row) != count:
                    raise SceneError(
                        f"pose: weights of node {key!r}: {len(row)} of them; its mesh has {count} "
                        "morph targets, give one a target"
                    )
                first = self.first_weight[index]
                weights[first : first + count] = row
        return weights

    def _mirrored(self, world_from_bind: Float64) -> NDArray[np.bool_]:
        mirrored = np.zeros(len(self._scene.instances), bool)
        sign = handedness(world_from_bind)
        for index in self._skinned:
            influences = self._scene.meshes[self._scene.instances[index].mesh].influences
            assert influences is not None
            first, shares = self.first_joint[index], influences.joint_shares
            mirrored[index] = float(shares @ sign[first : first + len(shares)]) < 0.0
        return mirrored

    def _by_node(self, what: str, given: Mapping[Node, Any]) -> dict[int, tuple[Node, Any]]:
        """What is given for each node, with the key that it is given by."""
        by_node: dict[int, tuple[Node, Any]] = {}
        for key, value in given.items():
            node = self._node(key)
            if node in by_node:
                raise SceneError(
                    f"pose: {what} of node {key!r}: given as node {by_node[node][0]!r} too; "
                    "give it once"
                )
            by_node[node] = key, value
        return by_node

    def _node(self, key: Node) -> int:
        """The index of a node, given that or its name."""
        nodes = self._scene.nodes
        if isinstance(key, str):
            places = nodes.places.get(key, [])
            if len(places) != 1:
                what = f"nodes {places[:8]} have this name" if places else "no node has this name"
                raise SceneError(f"pose: node '{key}': {what}; give the index of one")
            return places[0]
        if not 0 <= key < len(nodes):
            remedy = f"give 0 to {len(nodes) - 1}" if len(nodes) else "the scene has no nodes"
            raise SceneError(f"pose: node {key}: {remedy}")
        return int(key)


def _items(pose: Pose, name: str) -> list[tuple[Node, Any]]:
    """The entries of one of a pose's mappings, by nodes."""
    mapping = getattr(pose, name)
    if not isinstance(mapping, Mapping):
        raise SceneError(f"pose: {name}: {type(mapping).__name__}; give a dict by node")
    for node in mapping:
        if isinstance(node, bool) or not isinstance(node, int | np.integer | str):
            raise SceneError(f"pose: {name}: node {node!r}; give an index or a name")
    return list(mapping.items())


def _numbers(node: Node, what: str, values: Any) -> Float64:
    """A read-only copy of finite numbers."""
    try:
        numbers = np.array(values, np.float64)
    except (TypeError, ValueError):
        numbers = np.array(np.nan)
    if not np.isfinite(numbers).all():
        raise SceneError(f"pose: {what} of node {node!r}: {values!r}; give finite numbers")
    numbers.setflags(write=False)
    return numbers

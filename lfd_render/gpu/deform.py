"""What deforms vertices, on the device: morph displacements and joint influences, uploaded once,
and the matrices and weights that each frame writes.

Displacements are stored sparse: a vertex has entries of the targets that move it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lfd_render.errors import ResourceError, SceneError
from lfd_render.gpu.layout import dtype
from lfd_render.gpu.memory import Buffer
from lfd_render.scene import Mesh, Posed, Poser, Scene

if TYPE_CHECKING:
    from lfd_render.gpu.device import Device

BATCH_DELTAS = 1 << 22  # of 28 bytes: below llvmpipe's 128 MiB a buffer
_CHUNK = 1 << 20  # displacements looked at together: 24 MB
_SET = 4  # joints of a set of influences


@dataclass(frozen=True, eq=False)
class VertexDeform:
    """What deforms the vertices of a mesh. ranges: uint32 [n, 2], where each one's entries of
    deltas: MorphDelta [m] start and end; joints: uint32 [n, set, 2], 2 × uint16 each; weights:
    float32 [n, set, 4], without sets where no skin moves it. flat: normals are the triangles'."""

    ranges: NDArray[np.uint32]
    deltas: NDArray[np.void]
    joints: NDArray[np.uint32]
    weights: NDArray[np.float32]
    flat: bool

    @property
    def most_deltas(self) -> int:
        """Entries of the vertex that has the most."""
        return int((self.ranges[:, 1] - self.ranges[:, 0]).max(initial=0))

    def spans(self, first_delta: int, first_influence: int) -> NDArray[np.void]:
        """DeformSpan [n], where deltas and influences start so far into their buffers."""
        count, sets = self.weights.shape[:2]
        spans = np.zeros(count, dtype("DeformSpan"))
        spans["first_delta"], spans["end_delta"] = (self.ranges + np.uint32(first_delta)).T
        spans["first_influence"] = first_influence + sets * np.arange(count)
        spans["end_influence"] = spans["first_influence"] + sets
        return spans

    def of(self, used: NDArray[np.integer]) -> VertexDeform:
        """That of some vertices."""
        first, end = self.ranges[used].astype(np.int64).T
        counts = end - first
        ends = np.cumsum(counts)
        entries = np.repeat(first - (ends - counts), counts) + np.arange(int(counts.sum()))
        ranges = np.stack([ends - counts, ends], axis=1).astype(np.uint32)
        return VertexDeform(
            ranges, self.deltas[entries], self.joints[used], self.weights[used], self.flat
        )


def vertex_deform(mesh: Mesh, *, skinned: bool) -> VertexDeform:
    """What deforms a mesh's vertices. skinned: its influences count."""
    count = len(mesh.positions)
    ranges, deltas = _deltas(mesh)
    joints: NDArray[np.uint32] = np.zeros((count, 0, 2), np.uint32)
    weights: NDArray[np.float32] = np.zeros((count, 0, _SET), np.float32)
    if skinned:
        assert mesh.influences is not None
        pairs = mesh.influences.joints.reshape(count, -1, 2, 2).astype(np.uint32)
        joints = np.asarray(pairs[..., 0] | pairs[..., 1] << 16, np.uint32)
        weights = mesh.influences.weights.reshape(count, -1, _SET)
    return VertexDeform(ranges, deltas, joints, weights, mesh.flat)


def _deltas(mesh: Mesh) -> tuple[NDArray[np.uint32], NDArray[np.void]]:
    """Ranges uint32 [n, 2] and the entries MorphDelta, by vertex and then by target."""
    count, morph = len(mesh.positions), mesh.morph
    if morph is None:
        return np.zeros((count, 2), np.uint32), np.zeros(0, dtype("MorphDelta"))
    parts, counts = [], []
    step = max(1, _CHUNK // len(morph.positions))
    for first in range(0, count, step):
        positions = morph.positions[:, first : first + step]
        normals = morph.normals[:, first : first + step]
        moved = positions.any(axis=2) | normals.any(axis=2)  # [target, vertex]
        vertex, target = np.nonzero(moved.T)
        entries = np.zeros(len(vertex), dtype("MorphDelta"))
        entries["target"] = target
        for axis, name in enumerate("xyz"):
            entries[f"position_{name}"] = positions[target, vertex, axis]
            entries[f"normal_{name}"] = normals[target, vertex, axis]
        parts.append(entries)
        counts.append(np.count_nonzero(moved, axis=0))
    ends = np.cumsum(np.concatenate(counts))
    if int(ends[-1]) >= 1 << 32:
        raise ResourceError(
            f"mesh '{mesh.name}': {ends[-1]} displacements of morph targets; give a mesh of fewer "
            "vertices or targets"
        )
    ranges = np.stack([ends - np.concatenate(counts), ends], axis=1).astype(np.uint32)
    return ranges, np.concatenate(parts)


class BatchDeform:
    """The deformed vertices of a batch, after its rigid ones: `first` is the first of them,
    `first_flat` the first whose normals are the triangles'."""

    def __init__(
        self, device: Device, parts: Sequence[VertexDeform], first: int, first_flat: int
    ) -> None:
        self.first, self.first_flat = first, first_flat
        distinct = list({id(part): part for part in parts}.values())  # all draws of a mesh share
        starts, delta, influence = {}, 0, 0
        for part in distinct:
            starts[id(part)] = delta, influence
            delta += len(part.deltas)
            influence += part.weights.shape[0] * part.weights.shape[1]
        spans = [part.spans(*starts[id(part)]) for part in parts]
        joints = [part.joints.reshape(-1, 2) for part in distinct]
        weights = [part.weights.reshape(-1, _SET) for part in distinct]
        label = "deformation"
        self._spans = Buffer.of(device, label, np.concatenate(spans))
        self._deltas = Buffer.of(device, label, np.concatenate([p.deltas for p in distinct]))
        self._joints = Buffer.of(device, label, np.concatenate(joints))
        self._weights = Buffer.of(device, label, np.concatenate(weights))

    def buffers(self) -> dict[str, Buffer]:
        """What the deforming kernel reads, by block name."""
        return {
            "DeformSpans": self._spans,
            "MorphDeltas": self._deltas,
            "InfluenceJoints": self._joints,
            "InfluenceWeights": self._weights,
        }

    def release(self) -> None:
        """Free the buffers."""
        for buffer in (self._spans, self._deltas, self._joints, self._weights):
            buffer.release()


class Deformation:
    """Joint matrices and morph weights of a scene, which `place` writes each frame. Instances that
    deform without a skin have a joint of their own, their placement.

    first_joint, first_weight: uint32 [instance], where theirs start.
    """

    def __init__(self, device: Device, scene: Scene, poser: Poser) -> None:
        self._scene = scene
        skin_joints = sum(len(skin.joints) for skin in scene.skins)
        unskinned = [i.skin is None and scene.deforms(i) for i in scene.instances]
        self._unskinned = np.flatnonzero(unskinned)
        first = poser.first_joint.copy()
        first[self._unskinned] = skin_joints + np.arange(len(self._unskinned))
        self.first_joint = np.maximum(first, 0).astype(np.uint32)
        self.first_weight = poser.first_weight.astype(np.uint32)
        self._records = np.zeros((skin_joints + len(self._unskinned), 3, 4), np.float32)
        weights = sum(len(i.weights) for i in scene.instances)
        self._weight_words = np.zeros(max(1, weights), np.float32)
        self._joints = Buffer(device, "joints", self._records.nbytes)
        self._weights = Buffer(device, "joints", self._weight_words.nbytes)

    def place(self, display_from_world: NDArray[np.float64], posed: Posed) -> None:
        """Write the matrices, as display_from_bind, and the weights. Raises SceneError for what
        single precision cannot hold."""
        placements = posed.world_from_instance[self._unskinned]
        with np.errstate(over="ignore", invalid="ignore"):
            world = np.concatenate([posed.world_from_bind, placements])
            self._records[:] = (display_from_world @ world)[:, :3]
            self._weight_words[: len(posed.weights)] = posed.weights
        if not (np.isfinite(self._records).all() and np.isfinite(self._weight_words).all()):
            raise SceneError(
                f"scene '{self._scene.name}': joints or morph weights too small, large or far away "
                "beside the camera's window for single precision; scale them or move the camera"
            )
        self._joints.write(self._records)
        self._weights.write(self._weight_words)

    def buffers(self) -> dict[str, Buffer]:
        """What the deforming kernel reads, by block name."""
        return {"JointMatrices": self._joints, "MorphWeights": self._weights}

    def release(self) -> None:
        """Free the buffers."""
        self._joints.release()
        self._weights.release()

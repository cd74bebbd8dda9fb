"""A scene on the device: batches of triangles, draws, materials and textures.

A batch holds triangles of one kind (opaque, or tested for alpha) of as many draws as fit the limits;
ids of triangles run through the batches. What depends on the camera, the draws' matrices, is written
each frame; everything else is uploaded once.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lfd_render.gpu.layout import CONSTANTS, dtype
from lfd_render.gpu.memory import Buffer
from lfd_render.gpu.textures import MaterialTextures
from lfd_render.scene import Material, Mesh, Scene

if TYPE_CHECKING:
    from lfd_render.gpu.device import Device

# 16 bytes a triangle and 32 a vertex: both stay below llvmpipe's 128 MiB a buffer.
BATCH_TRIANGLES = 1 << 22
BATCH_VERTICES = 1 << 21


@dataclass(frozen=True)
class DrawRun:
    """Consecutive triangles of a batch that hardware raster draws with one state."""

    first: int
    count: int
    double_sided: bool
    mirrored: bool


@dataclass
class _Part:
    """Triangles of one draw, with exactly the vertices they use."""

    draw: int
    positions: NDArray[np.float32]
    vertices: NDArray[np.void]
    triangles: NDArray[np.uint32]


class Batch:
    """Buffers of one batch. `triangle_base` is the id of its first triangle."""

    def __init__(
        self, device: Device, parts: list[_Part], triangle_base: int, *, alpha_tested: bool
    ) -> None:
        vertex_counts = [len(part.positions) for part in parts]
        starts = np.concatenate(([0], np.cumsum(vertex_counts)[:-1]))
        self.triangle_base = triangle_base
        self.alpha_tested = alpha_tested
        self.vertices = int(sum(vertex_counts))
        self.triangles = sum(len(part.triangles) for part in parts)
        self.draws = [(part.draw, len(part.triangles)) for part in parts]

        positions = np.empty((self.vertices, 4), np.float32)
        corners = np.empty((self.triangles, 4), np.uint32)
        row = 0
        for part, start in zip(parts, starts, strict=True):
            stop = start + len(part.positions)
            positions[start:stop, :3] = part.positions
            positions[start:stop, 3] = np.uint32(part.draw).view(np.float32)
            end = row + len(part.triangles)
            corners[row:end, :3] = part.triangles + np.uint32(start)
            corners[row:end, 3] = part.draw
            row = end
        self.local_positions = Buffer.of(device, "positions", positions)
        self.display_positions = Buffer(device, "display positions", positions.nbytes)
        self.vertex_data = Buffer.of(
            device, "vertices", np.concatenate([part.vertices for part in parts])
        )
        self.corners = Buffer.of(device, "triangles", corners)

    def geometry(self) -> dict[str, Buffer]:
        """What visibility reads, by block name (draws are the scene's)."""
        return {"Triangles": self.corners, "DisplayPositions": self.display_positions}

    def release(self) -> None:
        """Free the batch."""
        for buffer in (
            self.local_positions, self.display_positions, self.vertex_data, self.corners,
        ):  # fmt: skip
            buffer.release()


class SceneBuffers:
    """A scene, uploaded."""

    def __init__(self, device: Device, scene: Scene) -> None:
        self.scene = scene
        self.textures = MaterialTextures(device, scene.materials, scene.images)
        self.warnings = [*scene.warnings, *self.textures.warnings]
        self._world_from_local = np.stack([i.world_from_local for i in scene.instances])
        normal = np.linalg.inv(_nonsingular(self._world_from_local[:, :3, :3])).transpose(0, 2, 1)
        self._records = np.zeros(len(scene.instances), dtype("Draw"))
        for axis, field in enumerate(("x", "y", "z")):
            # Normals are normalised where they are used; only the largest entry must be near 1.
            scale = np.abs(normal).max(axis=(1, 2), keepdims=True)
            self._records[f"normal_matrix_{field}"][:, :3] = (normal / scale)[:, :, axis]
        self._records["material"] = [scene.meshes[i.mesh].material for i in scene.instances]
        self.draws = Buffer(device, "draws", self._records.nbytes)
        self.materials = Buffer.of(device, "materials", _material_records(scene.materials))
        self.slots = Buffer.of(device, "materials", self.textures.slots)
        self.batches: list[Batch] = []
        base = 0
        for alpha_tested in (False, True):
            for parts in _batches(scene, alpha_tested=alpha_tested):
                batch = Batch(device, parts, base, alpha_tested=alpha_tested)
                self.batches.append(batch)
                base += batch.triangles
        self.triangles = base
        device.check()

    def place(self, display_from_world: NDArray[np.float64]) -> None:
        """Write the draws for a camera. display_from_world: float64 [4, 4]."""
        matrices = display_from_world @ self._world_from_local
        self._records["display_from_local"] = (
            matrices.transpose(0, 2, 1).reshape(-1, 16).astype(np.float32)
        )
        mirrored = np.linalg.det(matrices[:, :3, :3]) < 0.0
        sided = [self._material(draw).double_sided for draw in range(len(self._records))]
        self._records["facing"] = np.where(mirrored, CONSTANTS["FACING_MIRRORED"], 0) | np.where(
            sided, CONSTANTS["FACING_BOTH"], 0
        )
        self.draws.write(self._records)

    def runs(self, batch: Batch) -> list[DrawRun]:
        """The batch's triangles in runs of equal raster state."""
        runs: list[DrawRun] = []
        first = 0
        for draw, count in batch.draws:
            facing = int(self._records["facing"][draw])
            both = bool(facing & CONSTANTS["FACING_BOTH"])
            mirrored = bool(facing & CONSTANTS["FACING_MIRRORED"])
            if runs and (runs[-1].double_sided, runs[-1].mirrored) == (both, mirrored):
                last = runs.pop()
                runs.append(DrawRun(last.first, last.count + count, both, mirrored))
            else:
                runs.append(DrawRun(first, count, both, mirrored))
            first += count
        return runs

    def materials_of(self) -> dict[str, Buffer]:
        """What shading reads besides geometry, by block name."""
        return {"Materials": self.materials, "TextureSlots": self.slots}

    def constants(self) -> dict[str, int]:
        """Macros that shaders reading textures need."""
        return {
            "SRGB_GROUPS": len(self.textures.srgb),
            "LINEAR_GROUPS": len(self.textures.linear),
        }

    def _material(self, draw: int) -> Material:
        return self.scene.materials[int(self._records["material"][draw])]

    def release(self) -> None:
        """Free everything."""
        for batch in self.batches:
            batch.release()
        for buffer in (self.draws, self.materials, self.slots):
            buffer.release()
        self.textures.release()


def _nonsingular(matrices: NDArray[np.float64]) -> NDArray[np.float64]:
    """Flattened placements have no inverse; their normals do not matter, only that it exists."""
    singular = np.abs(np.linalg.det(matrices)) < np.finfo(np.float64).tiny
    return np.where(singular[:, None, None], np.eye(3), matrices)


def _batches(scene: Scene, *, alpha_tested: bool) -> Iterator[list[_Part]]:
    """Parts of all draws of one kind, in lists that fit a batch."""
    parts: list[_Part] = []
    triangles = vertices = 0
    attributes: dict[int, NDArray[np.void]] = {}
    for draw, instance in enumerate(scene.instances):
        mesh = scene.meshes[instance.mesh]
        if (scene.materials[mesh.material].alpha_mode != "opaque") != alpha_tested:
            continue
        if instance.mesh not in attributes:
            attributes[instance.mesh] = _vertex_records(mesh)
        for part in _split(draw, mesh, attributes[instance.mesh]):
            full = triangles + len(part.triangles) > BATCH_TRIANGLES
            if parts and (full or vertices + len(part.positions) > BATCH_VERTICES):
                yield parts
                parts, triangles, vertices = [], 0, 0
            parts.append(part)
            triangles += len(part.triangles)
            vertices += len(part.positions)
    if parts:
        yield parts


def _split(draw: int, mesh: Mesh, vertices: NDArray[np.void]) -> Iterator[_Part]:
    """One mesh in parts that fit a batch; nearly always it fits whole."""
    if len(mesh.triangles) <= BATCH_TRIANGLES and len(mesh.positions) <= BATCH_VERTICES:
        yield _Part(draw, mesh.positions, vertices, mesh.triangles)
        return
    step = min(BATCH_TRIANGLES, BATCH_VERTICES // 3)  # even if no two triangles share a vertex
    for first in range(0, len(mesh.triangles), step):
        used, triangles = np.unique(mesh.triangles[first : first + step], return_inverse=True)
        corners = triangles.reshape(-1, 3).astype(np.uint32)
        yield _Part(draw, mesh.positions[used], vertices[used], corners)


def _vertex_records(mesh: Mesh) -> NDArray[np.void]:
    records = np.zeros(len(mesh.positions), dtype("Vertex"))
    records["uv0"] = mesh.texcoords[:, 0]
    records["uv1"] = mesh.texcoords[:, 1]
    records["normal_oct"] = _octahedral(mesh.normals)
    color = np.rint(np.clip(mesh.colors, 0.0, 1.0) * 65535.0).astype(np.uint32)
    records["color_rg"] = color[:, 0] | color[:, 1] << 16
    records["color_ba"] = color[:, 2] | color[:, 3] << 16
    return records


def _octahedral(normals: NDArray[np.float32]) -> NDArray[np.uint32]:
    """Unit vectors [n, 3] → 2 × snorm16 (Cigolle et al. 2014)."""
    n = normals / np.maximum(np.abs(normals).sum(axis=1, keepdims=True), 1e-20)
    signs = np.where(n[:, :2] < 0.0, -1.0, 1.0)
    folded = (1.0 - np.abs(n[:, 1::-1])) * signs
    flat = np.where(n[:, 2:] < 0.0, folded, n[:, :2])
    words = np.rint(flat * 32767.0).astype(np.int16).astype(np.uint16).astype(np.uint32)
    return words[:, 0] | words[:, 1] << 16


def _material_records(materials: tuple[Material, ...]) -> NDArray[np.void]:
    records = np.zeros(len(materials), dtype("Material"))
    for record, material in zip(records, materials, strict=True):
        record["base_color"] = material.base_color
        record["emissive"][:3] = material.emissive
        record["metallic"] = material.metallic
        record["roughness"] = material.roughness
        record["alpha_cutoff"] = material.alpha_cutoff
        record["alpha_mode"] = CONSTANTS[f"ALPHA_{material.alpha_mode.upper()}"]
        record["unlit"] = material.unlit
    return records

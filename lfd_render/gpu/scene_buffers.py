"""A scene on the device: batches of triangles, draws, materials and textures.

A batch holds triangles of one alpha mode, of as many draws as fit the limits; ids of triangles run
through the batches. What depends on the camera and the pose, matrices and weights, is written each
frame; everything else is uploaded once.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lfd_render.errors import SceneError
from lfd_render.gpu.deform import (
    BATCH_DELTAS,
    BatchDeform,
    Deformation,
    VertexDeform,
    vertex_deform,
)
from lfd_render.gpu.layout import CONSTANTS, TEXTURE_ROLES, dtype
from lfd_render.gpu.lighting import Lighting
from lfd_render.gpu.memory import Buffer, TextureArray
from lfd_render.gpu.textures import MaterialTextures
from lfd_render.scene import Material, Mesh, Pose, Poser, Scene
from lfd_render.scene.model import ALPHA_MODES, AlphaMode
from lfd_render.scene.nodes import handedness

if TYPE_CHECKING:
    from lfd_render.gpu.device import Device

# 16 bytes a triangle and 32 a vertex: both stay below llvmpipe's 128 MiB a buffer.
BATCH_TRIANGLES = 1 << 22
BATCH_VERTICES = 1 << 21
_LEAST_ALPHA = 1 / 255  # of a blended texel that shows


@dataclass(frozen=True)
class DrawRun:
    """Consecutive triangles of a batch that hardware raster draws with one state."""

    first: int
    count: int
    double_sided: bool
    mirrored: bool

    @property
    def facing(self) -> int:
        """FACING_* bits."""
        both = CONSTANTS["FACING_BOTH"] if self.double_sided else 0
        return both | (CONSTANTS["FACING_MIRRORED"] if self.mirrored else 0)


@dataclass
class _Attributes:
    """What shading reads, in device form: normals [n] octahedral, uv0 [n, 2], extras [n], or [1]
    where the scene has none."""

    normals: NDArray[np.uint32]
    uv0: NDArray[np.float32]
    extras: NDArray[np.void]

    def of(self, used: NDArray[np.uint32]) -> _Attributes:
        """Those of some vertices."""
        extras = self.extras[used] if len(self.extras) == len(self.normals) else self.extras
        return _Attributes(self.normals[used], self.uv0[used], extras)


@dataclass
class _Part:
    """Triangles of one draw, with exactly the vertices they use."""

    draw: int
    positions: NDArray[np.float32]
    attributes: _Attributes
    triangles: NDArray[np.uint32]
    deform: VertexDeform | None

    @property
    def kind(self) -> int:
        """Vertices lie in this order in a batch: rigid, deformed, deformed with flat normals."""
        return 0 if self.deform is None else 1 + self.deform.flat


class Batch:
    """Buffers of one batch. `triangle_base` is the id of its first triangle. Its first
    `rigid_vertices` go by their draws' matrices alone, the others by `deform`."""

    def __init__(
        self, device: Device, parts: list[_Part], triangle_base: int, alpha_mode: AlphaMode
    ) -> None:
        vertex_counts = [len(part.positions) for part in parts]
        in_order = sorted(parts, key=lambda part: part.kind)
        ends = np.cumsum([len(part.positions) for part in in_order])
        start_of = {
            id(part): int(end) - len(part.positions)
            for part, end in zip(in_order, ends, strict=True)
        }
        starts = [start_of[id(part)] for part in parts]
        self.triangle_base = triangle_base
        self.alpha_mode = alpha_mode
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
        attributes = [part.attributes for part in in_order]
        self.local_positions = Buffer.of(device, "positions", positions)
        self.display_vertices = Buffer(device, "display vertices", positions.nbytes)
        normals = np.concatenate([a.normals for a in attributes])
        self.local_normals = Buffer.of(device, "normals", normals)
        uv0 = [a.uv0 for a in attributes]
        if self.vertices % 2:  # shaders fetch those of two vertices at a time
            uv0.append(np.zeros((1, 2), np.float32))
        self.uv0 = Buffer.of(device, "texture coordinates", np.concatenate(uv0))
        self.extras = Buffer.of(
            device, "vertex extras", np.concatenate([a.extras for a in attributes])
        )
        self.corners = Buffer.of(device, "triangles", corners)
        self.rigid_vertices = sum(len(part.positions) for part in parts if part.kind == 0)
        smooth = sum(len(part.positions) for part in parts if part.kind == 1)
        deforms = [part.deform for part in in_order if part.deform is not None]
        self.deform: BatchDeform | None = None
        if deforms:
            first = self.rigid_vertices
            self.deform = BatchDeform(device, deforms, first, first + smooth)

    def corner_indices(self) -> NDArray[np.uint32]:
        """Vertices of the triangles, [triangle, 3], for draws. Waits for the device."""
        corners: NDArray[np.uint32] = self.corners.read(np.uint32)
        return np.ascontiguousarray(corners.reshape(-1, 4)[:, :3])

    def geometry(self) -> dict[str, Buffer]:
        """What visibility reads, by block name (draws are the scene's)."""
        return {"Triangles": self.corners, "DisplayVertices": self.display_vertices}

    def attributes(self) -> dict[str, Buffer]:
        """Texture coordinates and colours of vertices, by block name."""
        return {"TexCoords": self.uv0, "VertexExtras": self.extras}

    def release(self) -> None:
        """Free the batch."""
        for buffer in (
            self.local_positions, self.display_vertices, self.local_normals, self.uv0, self.extras,
            self.corners,
        ):  # fmt: skip
            buffer.release()
        if self.deform:
            self.deform.release()


class SceneBuffers:
    """A scene, uploaded."""

    def __init__(self, device: Device, scene: Scene) -> None:
        self.scene = scene
        self.textures = MaterialTextures(device, scene.materials, scene.images)
        self.lighting = Lighting(device, scene.lights)
        self.warnings = [*scene.warnings, *self.textures.warnings]
        self._records = np.zeros(len(scene.instances), dtype("Draw"))
        self._poser = Poser(scene)
        self._stand(None)
        self._records["material"] = [scene.meshes[i.mesh].material for i in scene.instances]
        sided = np.array([m.double_sided for m in scene.materials])
        self._double_sided = sided[self._records["material"]]
        self.deformation: Deformation | None = None
        self._deforms = np.array([scene.deforms(instance) for instance in scene.instances])
        if self._deforms.any():
            self.deformation = Deformation(device, scene, self._poser)
            self._records["first_joint"] = self.deformation.first_joint
            self._records["first_weight"] = self.deformation.first_weight
        self.draws = Buffer(device, "draws", self._records.nbytes)
        self.materials = Buffer.of(
            device, "materials", _material_records(scene, self.textures.slots)
        )
        self.uv_transforms = Buffer.of(device, "materials", self.textures.uv_transforms)
        slots = [slot for m in scene.materials for slot in m.texture_slots().values()]
        second_set = any(slot.texcoord == 1 for slot in slots)
        self._extras = any(_needs_extras(mesh, second_set) for mesh in scene.meshes)
        self.batches: list[Batch] = []
        base = 0
        for alpha_mode in ALPHA_MODES:
            for parts in _batches(scene, alpha_mode, extras=self._extras):
                batch = Batch(device, parts, base, alpha_mode)
                self.batches.append(batch)
                base += batch.triangles
        self.triangles = base
        device.check()

    def pose(self, pose: Pose | None) -> None:
        """Stand the scene in a pose, by default at rest, from the next `place` on.

        Raises SceneError if it does not fit.
        """
        if pose is not self._pose:
            self._stand(pose)

    def _stand(self, pose: Pose | None) -> None:
        self._posed = self._poser(pose)
        self._pose = pose
        normal = _cofactors(self._posed.world_from_instance[:, :3, :3])
        for axis, field in enumerate(("x", "y", "z")):
            # Normals are normalised where they are used; only the largest entry must be near 1.
            scale = np.maximum(np.abs(normal).max(axis=(1, 2), keepdims=True), 1e-300)
            self._records[f"normal_matrix_{field}"][:, :3] = (normal / scale)[:, :, axis]
        self.lighting.world_from_light = self._posed.world_from_light

    def place(self, display_from_world: NDArray[np.float64]) -> None:
        """Write the draws for a camera, in the pose. display_from_world: float64 [4, 4]."""
        with np.errstate(over="ignore", invalid="ignore"):
            matrices = display_from_world @ self._posed.world_from_instance
            mirrored = (handedness(matrices) < 0.0) != self._posed.mirrored
            matrices[self._deforms] = np.eye(4)  # they go by joints, and may be beyond float32
            words = matrices.transpose(0, 2, 1).reshape(-1, 16).astype(np.float32)
        if not np.isfinite(words).all():
            name = self.scene.instances[int(np.argmin(np.isfinite(words).all(axis=1)))].name
            raise SceneError(
                f"scene '{self.scene.name}': instance '{name}': too small, large or far away "
                "beside the camera's window for single precision; scale it or move the camera"
            )
        self._records["display_from_local"] = words
        self._records["facing"] = np.where(mirrored, CONSTANTS["FACING_MIRRORED"], 0) | np.where(
            self._double_sided, CONSTANTS["FACING_BOTH"], 0
        )
        if self.deformation:
            self.deformation.place(display_from_world, self._posed)
        self.draws.write(self._records)
        self.lighting.place(display_from_world)
        # How planes go the other way: n_world = Mᵗ·n_display for M = display_from_world.
        linear = display_from_world[:3, :3]
        self.world_from_display_plane = np.eye(4)
        self.world_from_display_plane[:3, :3] = linear.T / np.abs(linear).max()

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
        """Materials, by block name."""
        return {
            "Materials": self.materials,
            "UvTransforms": self.uv_transforms,
        }

    def samplers(self) -> dict[str, list[TextureArray]]:
        """Texture arrays, by sampler name."""
        return {"srgb_maps": self.textures.srgb, "linear_maps": self.textures.linear}

    @cached_property
    def _constants(self) -> dict[str, int]:
        materials = self.scene.materials
        roles = 0
        for bit, role in enumerate(TEXTURE_ROLES):
            if any(getattr(m, f"{role}_texture") is not None for m in materials):
                roles |= 1 << bit
        slots = [slot for m in materials for slot in m.texture_slots().values()]
        return {
            "SRGB_GROUPS": len(self.textures.srgb),
            "LINEAR_GROUPS": len(self.textures.linear),
            "ROLES": roles,
            "VERTEX_EXTRAS": int(self._extras),
            "UV_TRANSFORMS": int(any(slot.uv_transform is not None for slot in slots)),
            "SHARED_OCCLUSION": int(all(_shares_occlusion(m) for m in materials)),
        }

    def constants(self) -> dict[str, int]:
        """Macros of the shaders that read vertices or materials: what this scene has."""
        return self._constants

    def release(self) -> None:
        """Free everything."""
        for batch in self.batches:
            batch.release()
        for buffer in (self.draws, self.materials, self.uv_transforms):
            buffer.release()
        if self.deformation:
            self.deformation.release()
        self.textures.release()
        self.lighting.release()


def _cofactors(matrices: NDArray[np.float64]) -> NDArray[np.float64]:
    """What normals go by: the inverse transpose times |determinant|, [n, 3, 3], which flattened
    placements have too."""
    columns = matrices.transpose(0, 2, 1)
    # Scaled first, so that products neither overflow nor vanish.
    columns = columns / np.maximum(np.abs(columns).max(axis=(1, 2), keepdims=True), 1e-300)
    x, y, z = columns[:, 0], columns[:, 1], columns[:, 2]
    cofactors = np.stack([np.cross(y, z), np.cross(z, x), np.cross(x, y)], axis=2)
    determinant = np.einsum("ni,ni->n", x, cofactors[:, :, 0])
    return cofactors * np.where(determinant < 0.0, -1.0, 1.0)[:, None, None]


def _needs_extras(mesh: Mesh, second_set: bool) -> bool:
    """Whether a mesh has colours, or a second coordinate set that some material reads."""
    colored = mesh.colors.min(initial=1.0) < 1.0  # above 1 they are taken as 1
    return bool(colored or (second_set and mesh.texcoords[:, 1].any()))


def _shares_occlusion(material: Material) -> bool:
    """Whether occlusion, if any, is the red channel of the metallic-roughness texture."""
    occlusion, packed = material.occlusion_texture, material.metallic_roughness_texture
    if occlusion is None:
        return True
    return packed is not None and (
        (occlusion.image, occlusion.texcoord, occlusion.wrap)
        == (packed.image, packed.texcoord, packed.wrap)
        and occlusion.uv_transform is None
        and packed.uv_transform is None
    )


def _batches(scene: Scene, alpha_mode: AlphaMode, *, extras: bool) -> Iterator[list[_Part]]:
    """Parts of all draws of one alpha mode, in lists that fit a batch."""
    parts: list[_Part] = []
    triangles = vertices = deltas = 0
    attributes: dict[int, _Attributes] = {}
    deforms: dict[tuple[int, bool], VertexDeform] = {}
    shared: set[int] = set()  # what deforms parts of the batch already
    for draw, instance in enumerate(scene.instances):
        mesh = scene.meshes[instance.mesh]
        if scene.materials[mesh.material].alpha_mode != alpha_mode:
            continue
        if instance.mesh not in attributes:
            attributes[instance.mesh] = _attributes(mesh, extras=extras)
        key = instance.mesh, instance.skin is not None
        if scene.deforms(instance) and key not in deforms:
            deforms[key] = vertex_deform(mesh, skinned=key[1])
        for part in _split(draw, mesh, attributes[instance.mesh], deforms.get(key)):
            full = triangles + len(part.triangles) > BATCH_TRIANGLES
            full |= vertices + len(part.positions) > BATCH_VERTICES
            if parts and (full or deltas + _new_deltas(part, shared) > BATCH_DELTAS):
                yield parts
                parts, triangles, vertices, deltas = [], 0, 0, 0
                shared.clear()
            deltas += _new_deltas(part, shared)
            shared.add(id(part.deform))
            parts.append(part)
            triangles += len(part.triangles)
            vertices += len(part.positions)
    if parts:
        yield parts


def _new_deltas(part: _Part, shared: set[int]) -> int:
    """Displacements that a part adds to a batch, whose draws of one mesh share them."""
    deform = part.deform
    return 0 if deform is None or id(deform) in shared else len(deform.deltas)


def _split(
    draw: int, mesh: Mesh, vertices: _Attributes, deform: VertexDeform | None
) -> Iterator[_Part]:
    """One mesh in parts that fit a batch; nearly always it fits whole."""
    fits = deform is None or len(deform.deltas) <= BATCH_DELTAS
    if fits and len(mesh.triangles) <= BATCH_TRIANGLES and len(mesh.positions) <= BATCH_VERTICES:
        yield _Part(draw, mesh.positions, vertices, mesh.triangles, deform)
        return
    step = min(BATCH_TRIANGLES, BATCH_VERTICES // 3)  # even if no two triangles share a vertex
    if deform is not None:
        step = min(step, max(1, BATCH_DELTAS // max(1, 3 * deform.most_deltas)))
    for first in range(0, len(mesh.triangles), step):
        used, triangles = np.unique(mesh.triangles[first : first + step], return_inverse=True)
        corners = triangles.reshape(-1, 3).astype(np.uint32)
        cut = None if deform is None else deform.of(used)
        yield _Part(draw, mesh.positions[used], vertices.of(used), corners, cut)


def _attributes(mesh: Mesh, *, extras: bool) -> _Attributes:
    records = np.zeros(len(mesh.positions) if extras else 1, dtype("VertexExtra"))
    if extras:
        records["uv1"] = mesh.texcoords[:, 1]
        color = np.rint(np.clip(mesh.colors, 0.0, 1.0) * 65535.0).astype(np.uint32)
        records["color_rg"] = color[:, 0] | color[:, 1] << 16
        records["color_ba"] = color[:, 2] | color[:, 3] << 16
    return _Attributes(_octahedral(mesh.normals), mesh.texcoords[:, 0], records)


def _octahedral(normals: NDArray[np.float32]) -> NDArray[np.uint32]:
    """Unit vectors [n, 3] → 2 × snorm16 (Cigolle et al. 2014)."""
    n = normals / np.maximum(np.abs(normals).sum(axis=1, keepdims=True), 1e-20)
    signs = np.where(n[:, :2] < 0.0, -1.0, 1.0)
    folded = (1.0 - np.abs(n[:, 1::-1])) * signs
    flat = np.where(n[:, 2:] < 0.0, folded, n[:, :2])
    words = np.rint(flat * 32767.0).astype(np.int16)
    return np.ascontiguousarray(words).view(np.uint32)[:, 0]  # x in the low half


def _material_records(scene: Scene, slots: NDArray[np.uint32]) -> NDArray[np.void]:
    """slots: as `MaterialTextures.slots`."""
    materials = scene.materials
    records = np.zeros(len(materials), dtype("Material"))
    color = np.array([m.base_color for m in materials])
    emissive = np.array([m.emissive for m in materials])
    cutoff = [_LEAST_ALPHA if m.alpha_mode == "blend" else m.alpha_cutoff for m in materials]
    surface = np.array([(m.metallic, m.roughness) for m in materials])
    normal = [m.normal_texture.scale if m.normal_texture else 1.0 for m in materials]
    occlusion = [m.occlusion_texture.scale if m.occlusion_texture else 1.0 for m in materials]
    records["base_color_rg"] = _unorm16x2(color[:, 0], color[:, 1])
    records["base_color_ba"] = _unorm16x2(color[:, 2], color[:, 3])
    records["emissive_rg"] = _half2(emissive[:, 0], emissive[:, 1])
    records["emissive_b_cutoff"] = _half2(emissive[:, 2], np.array(cutoff))
    records["metallic_roughness"] = _unorm16x2(surface[:, 0], surface[:, 1])
    records["normal_occlusion"] = _half2(np.array(normal), np.array(occlusion))
    records["flags"] = [CONSTANTS["UNLIT"] if m.unlit else 0 for m in materials]
    records["texels"] = _texels(scene)
    for role, words in zip(TEXTURE_ROLES, slots.reshape(-1, len(TEXTURE_ROLES)).T, strict=True):
        records[f"{role}_slot"] = words
    return records


def _texels(scene: Scene) -> NDArray[np.float64]:
    """Most texels that any texture lays on a unit of texture area, [material, coordinate set]."""
    texels = np.zeros((len(scene.materials), 2))
    for row, material in zip(texels, scene.materials, strict=True):
        for slot in material.texture_slots().values():
            height, width = scene.images[slot.image].pixels.shape[:2]
            stretch = 1.0 if slot.uv_transform is None else np.linalg.det(slot.uv_transform[:2, :2])
            row[slot.texcoord] = max(row[slot.texcoord], abs(stretch) * width * height)
    return texels


def _unorm16x2(low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.uint32]:
    words = np.rint(np.clip([low, high], 0.0, 1.0) * 65535.0).astype(np.uint32)
    return np.asarray(words[0] | words[1] << 16)


def _half2(low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.uint32]:
    largest = float(np.finfo(np.float16).max)
    words = np.clip([low, high], -largest, largest).astype(np.float16).view(np.uint16)
    return np.asarray(words[0] | words[1].astype(np.uint32) << 16)

"""Vertices, local space → display space; normals, local → world; and which id a triangle has."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lfd_render.scene import Instance, Mesh, Pose, Poser, Scene

Float64 = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Triangles:
    """Every triangle of a scene, in the order of its id.

    p_display, normals_world: [triangle, corner, xyz]; texcoords: [triangle, corner, set, uv];
    colors: [triangle, corner, rgba], all float64. material, instance: int64 [triangle];
    mirrored, double_sided, blended: bool [triangle].
    """

    p_display: Float64
    normals_world: Float64
    texcoords: Float64
    colors: Float64
    material: NDArray[np.int64]
    instance: NDArray[np.int64]
    mirrored: NDArray[np.bool_]
    double_sided: NDArray[np.bool_]
    blended: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.p_display)


def ordered_instances(scene: Scene) -> Iterator[tuple[int, Instance, Mesh]]:
    """Instances in the order of their triangles' ids: opaque, then masked, then blended ones.

    Yields the index of the instance, the instance and its mesh.
    """
    for mode in ("opaque", "mask", "blend"):
        for index, instance in enumerate(scene.instances):
            mesh = scene.meshes[instance.mesh]
            if scene.materials[mesh.material].alpha_mode == mode:
                yield index, instance, mesh


def placed(scene: Scene, display_from_world: Float64, pose: Pose | None = None) -> Triangles:
    """The triangles of a scene before a display, in a pose, by default at rest.

    display_from_world: float64 [4, 4], affine.
    """
    poser = Poser(scene)
    posed = poser(pose)
    p_display, normals, texcoords, colors, material, instances = [], [], [], [], [], []
    mirrored, double_sided, blended = [], [], []
    for index, instance, mesh in ordered_instances(scene):
        corners = mesh.triangles
        p_local, n_local = mesh.positions.astype(np.float64), mesh.normals.astype(np.float64)
        if scene.deforms(instance):
            p_local, n_local = poser.vertices(index, posed)
        world_from_local = posed.world_from_instance[index]
        display_from_local = display_from_world @ world_from_local
        count = len(corners)
        p_display.append(points_by(display_from_local, p_local)[corners])
        normals.append(normals_by(world_from_local, n_local)[corners])
        texcoords.append(mesh.texcoords.astype(np.float64)[corners])
        colors.append(mesh.colors.astype(np.float64)[corners])
        material.append(np.full(count, mesh.material))
        instances.append(np.full(count, index))
        turned_over = (np.linalg.det(display_from_local[:3, :3]) < 0.0) != posed.mirrored[index]
        mirrored.append(np.full(count, turned_over))
        kind = scene.materials[mesh.material]
        double_sided.append(np.full(count, kind.double_sided))
        blended.append(np.full(count, kind.alpha_mode == "blend"))
    return Triangles(
        np.concatenate(p_display),
        np.concatenate(normals),
        np.concatenate(texcoords),
        np.concatenate(colors),
        np.concatenate(material),
        np.concatenate(instances),
        np.concatenate(mirrored),
        np.concatenate(double_sided),
        np.concatenate(blended),
    )


def points_by(matrix: Float64, points: NDArray[np.floating]) -> Float64:
    """Points [n, 3] by an affine matrix [4, 4], in float64."""
    moved: Float64 = points.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    return moved


def normals_by(world_from_local: Float64, normals: NDArray[np.floating]) -> Float64:
    """Unit normals [n, 3] by the inverse transpose of a placement, made unit again.

    A normal n of a plane n·p = c keeps meeting the moved plane: n'·(M p) = c with n' = n·M⁻¹. With
    the singular values s of M = U·S·Vᵀ, M⁻ᵀ times |det M| is ±U·diag(s₁s₂, s₀s₂, s₀s₁)·Vᵀ, which a
    placement that flattens has as well.
    """
    linear = world_from_local[:3, :3]
    u, s, vt = np.linalg.svd(linear)
    s = s / max(float(s[0]), np.finfo(np.float64).tiny)
    cofactors = np.linalg.det(u @ vt) * u @ np.diag([s[1] * s[2], s[0] * s[2], s[0] * s[1]]) @ vt
    mirror = -1.0 if np.linalg.det(linear) < 0.0 else 1.0
    return unit(mirror * normals.astype(np.float64) @ cofactors.T)


def unit(vectors: Float64) -> Float64:
    """Vectors [..., 3] at length 1; zero stays zero."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(length > 0.0, length, 1.0)

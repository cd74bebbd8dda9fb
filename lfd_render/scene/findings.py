"""What a scene file holds that cannot be drawn as it may have been meant."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from lfd_render.scene.model import Mesh, Scene

UV_ROUNDING = 5e-7  # of texture coordinates, relative: what a file's own arithmetic leaves
_CHUNK = 1 << 18  # triangles looked at together: 40 MB


def findings(scene: Scene) -> list[str]:
    """Warnings: triangles without area, and normal textures on coordinates without area."""
    no_area: list[tuple[str, int]] = []
    no_tangent: list[tuple[str, int]] = []
    for mesh in scene.meshes:
        normal_texture = scene.materials[mesh.material].normal_texture
        texcoord = None if normal_texture is None else normal_texture.texcoord
        flat = turned = 0
        for area, uv_area in _areas(mesh, texcoord):
            flat += int(np.count_nonzero(~area))
            turned += int(np.count_nonzero(area & ~uv_area))
        if flat:
            no_area.append((mesh.name, flat))
        if turned:
            no_tangent.append((mesh.name, turned))
    warnings = []
    if no_area:
        warnings.append(f"triangles without area: {_count(no_area)}; they are not seen")
    if no_tangent:
        warnings.append(
            f"triangles with a normal texture on coordinates without area: {_count(no_tangent)}; "
            "it is left out there"
        )
    return warnings


def _count(found: list[tuple[str, int]]) -> str:
    return f"{sum(count for _, count in found)}, first in mesh '{found[0][0]}'"


def _areas(
    mesh: Mesh, texcoord: int | None
) -> Iterator[tuple[NDArray[np.bool_], NDArray[np.bool_]]]:
    """Whether triangles have an area in space, and in a set of texture coordinates, [triangle]."""
    for first in range(0, len(mesh.triangles), _CHUNK):
        triangles = mesh.triangles[first : first + _CHUNK]
        # Products of float32 differences neither vanish nor overflow in float64.
        a, b, c = mesh.positions[triangles].astype(np.float64).transpose(1, 2, 0)
        (ux, uy, uz), (vx, vy, vz) = b - a, c - a
        area = (uy * vz != uz * vy) | (uz * vx != ux * vz) | (ux * vy != uy * vx)
        uv_area = np.ones(len(triangles), bool)
        if texcoord is not None:
            a, b, c = mesh.texcoords[triangles, texcoord].astype(np.float64).transpose(1, 2, 0)
            (us, ut), (vs, vt) = b - a, c - a
            # As shading has it (`reference.shade.on_a_line`).
            largest = np.abs(mesh.texcoords[triangles, texcoord]).max(axis=(1, 2))
            lost = UV_ROUNDING * largest * (abs(us) + abs(ut) + abs(vs) + abs(vt))
            uv_area = np.abs(us * vt - ut * vs) > lost
        yield area, uv_area

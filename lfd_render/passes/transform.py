"""Vertices, local space → display space, morphed and skinned on the way."""

from lfd_render.gpu.device import Device
from lfd_render.gpu.programs import Kernel
from lfd_render.gpu.scene_buffers import Batch, SceneBuffers
from lfd_render.passes.placement import gl_matrix

_GROUP = 128  # local_size_x of transform/*.comp


class Transform:
    """SceneBuffers, Batch → Batch.display_vertices: rigid vertices by their draws' matrices,
    deformed ones by morph targets and joints, in a dispatch of their own."""

    def __init__(self, device: Device) -> None:
        self._rigid = Kernel(device, "transform/vertices.comp")
        self._deform = Kernel(device, "transform/deform.comp")
        self._flat = Kernel(device, "transform/flat.comp")

    def __call__(self, scene: SceneBuffers, batch: Batch) -> None:
        """Transform one batch; `scene.place` has written matrices and weights."""
        buffers = {
            "LocalPositions": batch.local_positions,
            "Draws": scene.draws,
            "DisplayVertices": batch.display_vertices,
        }
        if batch.rigid_vertices:
            self._rigid.set(
                {**buffers, "LocalNormals": batch.local_normals}, {"vertices": batch.rigid_vertices}
            )
            self._rigid.run(_groups(batch.rigid_vertices))
        if batch.deform is None:
            return
        assert scene.deformation is not None
        plane = gl_matrix(scene.world_from_display_plane)
        first, first_flat = batch.deform.first, batch.deform.first_flat
        self._deform.set(
            {
                **buffers,
                **batch.deform.buffers(),
                **scene.deformation.buffers(),
                "LocalNormals": batch.local_normals,
            },
            {
                "first": first,
                "vertices": batch.vertices - first,
                "world_from_display_plane": plane,
            },
        )
        self._deform.run(_groups(batch.vertices - first))
        triangles = (batch.vertices - first_flat) // 3
        if triangles:
            self._flat.set(
                buffers,
                {"first": first_flat, "triangles": triangles, "world_from_display_plane": plane},
            )
            self._flat.run(_groups(triangles))

    def release(self) -> None:
        """Free the kernels."""
        for kernel in (self._rigid, self._deform, self._flat):
            kernel.release()


def _groups(count: int) -> tuple[int, int, int]:
    return -(-count // _GROUP), 1, 1

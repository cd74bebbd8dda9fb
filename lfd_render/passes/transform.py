"""Vertices, local space → display space."""

from lfd_render.gpu.device import Device
from lfd_render.gpu.programs import Kernel
from lfd_render.gpu.scene_buffers import Batch, SceneBuffers

_GROUP = 128  # local_size_x of transform/vertices.comp


class Transform:
    """SceneBuffers, Batch → Batch.display_positions: each vertex by its draw's matrix."""

    def __init__(self, device: Device) -> None:
        self._kernel = Kernel(device, "transform/vertices.comp")

    def __call__(self, scene: SceneBuffers, batch: Batch) -> None:
        """Transform one batch; `scene.place` has written the matrices."""
        self._kernel.set(
            {
                "LocalPositions": batch.local_positions,
                "Draws": scene.draws,
                "LocalNormals": batch.local_normals,
                "DisplayPositions": batch.display_positions,
                "WorldNormals": batch.world_normals,
            },
            {"vertices": batch.vertices},
        )
        self._kernel.run((-(-batch.vertices // _GROUP), 1, 1))

    def release(self) -> None:
        """Free the kernel."""
        self._kernel.release()

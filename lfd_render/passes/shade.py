"""Shading: the winner of each view pixel → its scene-linear colour."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lfd_render.gpu.device import Device
from lfd_render.gpu.programs import Kernel
from lfd_render.gpu.scene_buffers import SceneBuffers
from lfd_render.passes.splat import ViewBuffers
from lfd_render.passes.view_target import Band, ViewTarget

_GROUP = 64  # local_size_x of shade/ray.comp


class Shade:
    """ViewBuffers, ViewTarget → ViewTarget.images: each visible pixel is shaded once, where its ray
    meets the triangle that its word names."""

    def __init__(self, device: Device, scene: SceneBuffers) -> None:
        self._scene = scene
        self._kernel = Kernel(device, "shade/ray.comp", scene.constants())

    def __call__(
        self,
        target: ViewTarget,
        band: Band,
        views: ViewBuffers,
        world_from_display: NDArray[np.float64],
        background: tuple[float, float, float],
    ) -> None:
        """Shade a band. world_from_display: float64 [4, 4]; background: linear RGB."""
        target.images.bind_image(0)
        for batch in self._scene.batches:
            self._kernel.set(
                {
                    **batch.geometry(),
                    **self._scene.materials_of(),
                    "Draws": self._scene.draws,
                    "Vertices": batch.vertex_data,
                    "FrameBlock": target.frame(band, batch),
                    "Words": views.words,
                    "Eyes": target.eyes,
                    "RowOffsets": target.row_offsets,
                },
                {"world_from_display": gl_matrix(world_from_display), "background": background},
                {"srgb_maps": self._scene.textures.srgb, "linear_maps": self._scene.textures.linear},
            )
            columns = -(-target.grid.columns // _GROUP)
            self._kernel.run((columns, band.rows, target.rig.views))

    def release(self) -> None:
        """Free the kernel."""
        self._kernel.release()


def gl_matrix(matrix: NDArray[np.float64]) -> bytes:
    """A [4, 4] matrix of column vectors as a mat4 uniform: float32, column by column."""
    return matrix.T.astype(np.float32).tobytes()

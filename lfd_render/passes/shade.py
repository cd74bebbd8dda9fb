"""Shading: the winner of each view pixel → its scene-linear colour."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lfd_render.gpu.device import Device
from lfd_render.gpu.layout import dtype
from lfd_render.gpu.memory import Buffer
from lfd_render.gpu.programs import Kernel
from lfd_render.gpu.scene_buffers import Batch, SceneBuffers
from lfd_render.passes.sample import GROUPS_ACROSS
from lfd_render.passes.splat import ViewBuffers
from lfd_render.passes.view_target import Band, ViewTarget

BLOCK = 16  # columns of a view shaded together
GROUP_BLOCKS = 4  # blocks of a work group
_LIST_GROUP = 64  # local_size_x of shade/blocks.comp


class Shade:
    """ViewBuffers, ViewTarget → ViewTarget.images: each visible pixel is shaded once, where its ray
    meets the triangle that its word names. `blend` lays the nearest blended surface over it."""

    def __init__(self, device: Device, scene: SceneBuffers, target: ViewTarget) -> None:
        constants = {
            "BLOCK": BLOCK,
            "GROUP_BLOCKS": GROUP_BLOCKS,
            "GROUPS_ACROSS": GROUPS_ACROSS,
            **scene.constants(),
        }
        self._scene = scene
        self._list = Kernel(device, "shade/blocks.comp", constants)
        self._opaque = Kernel(device, "shade/ray.comp", constants)
        self._blend = Kernel(device, "shade/blend.comp", constants)
        self._row_blocks = -(-target.grid.columns // BLOCK)
        lines = max(band.rows for band in target.bands) * target.rig.views
        self._blocks = Buffer(device, "shading blocks", 4 * self._row_blocks * lines)
        self._work = Buffer(device, "shading blocks", dtype("BlockWork").itemsize)
        self._no_work = np.zeros(1, dtype("BlockWork"))
        self._no_work["groups_z"] = 1

    def opaque(
        self,
        target: ViewTarget,
        band: Band,
        views: ViewBuffers,
        batches: Sequence[Batch],
        world_from_display: NDArray[np.float64],
        background: tuple[float, float, float],
    ) -> None:
        """Shade a band over a background. world_from_display: float64 [4, 4]; background: linear RGB."""
        target.images.clear((*background, 0.0))
        target.images.bind_image(0)
        self._run(self._opaque, target, band, views, batches, world_from_display)

    def blend(
        self,
        target: ViewTarget,
        band: Band,
        views: ViewBuffers,
        batches: Sequence[Batch],
        world_from_display: NDArray[np.float64],
    ) -> None:
        """Lay the blended surfaces that `views` now names over the band's images."""
        target.images.bind_image(0, writeonly=False)
        self._run(self._blend, target, band, views, batches, world_from_display)

    def _run(
        self,
        kernel: Kernel,
        target: ViewTarget,
        band: Band,
        views: ViewBuffers,
        batches: Sequence[Batch],
        world_from_display: NDArray[np.float64],
    ) -> None:
        block_count = self._row_blocks * target.rig.views * band.rows
        groups = -(-block_count // _LIST_GROUP)
        across = min(groups, GROUPS_ACROSS)
        for batch in batches:
            shared = {
                "FrameBlock": target.frame(band, batch),
                "Words": views.words,
                "Blocks": self._blocks,
                "BlockWorkBlock": self._work,
            }
            self._work.write(self._no_work)
            self._list.set(
                shared,
                {
                    "block_count": block_count,
                    "row_blocks": self._row_blocks,
                    "groups_across": across,
                },
            )
            self._list.run((across, -(-groups // across), 1))
            kernel.set(
                {
                    **shared,
                    **batch.geometry(),
                    **batch.attributes(),
                    **self._scene.materials_of(),
                    "Draws": self._scene.draws,
                    "Eyes": target.eyes,
                    "RowOffsets": target.row_offsets,
                },
                {
                    "world_from_display": gl_matrix(world_from_display),
                    "row_blocks": self._row_blocks,
                },
                self._scene.samplers(),
            )
            kernel.run_indirect(self._work)

    def release(self) -> None:
        """Free kernels and the list."""
        for owner in (self._list, self._opaque, self._blend, self._blocks, self._work):
            owner.release()


def gl_matrix(matrix: NDArray[np.float64]) -> bytes:
    """A [4, 4] matrix of column vectors as a mat4 uniform: float32, column by column."""
    return matrix.T.astype(np.float32).tobytes()

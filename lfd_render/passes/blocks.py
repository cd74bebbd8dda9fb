"""The blocks of view pixels that show a batch."""

from __future__ import annotations

import numpy as np

from lfd_render.gpu.device import Device
from lfd_render.gpu.layout import dtype
from lfd_render.gpu.memory import Buffer
from lfd_render.gpu.programs import Kernel
from lfd_render.gpu.scene_buffers import Batch
from lfd_render.passes.items import GROUPS_ACROSS
from lfd_render.passes.view_buffers import Winners
from lfd_render.passes.view_target import Band, ViewTarget

BLOCK = 16  # columns of a view that go together
_LIST_GROUP = 64  # local_size_x of shade/blocks.comp


def block_constants(device: Device) -> dict[str, int]:
    """Macros of what goes over listed blocks (shaders/shade/visible.glsl)."""
    each, abreast = (32, 1) if device.info.software else (1, 4)
    return {"BLOCK": BLOCK, "GROUP_BLOCKS": each * abreast, "BLOCKS_ABREAST": abreast}


class Blocks:
    """Winners → the list of blocks that show a batch, and `work`, which dispatches over it."""

    def __init__(
        self, device: Device, target: ViewTarget, word_stride: int, *, mark: bool = False
    ) -> None:
        """mark: also tell which triangles are shown."""
        constants = {
            **block_constants(device),
            "WORD_STRIDE": word_stride,
            "GROUPS_ACROSS": GROUPS_ACROSS,
            "MARK_TRIANGLES": int(mark),
        }
        self._list = Kernel(device, "shade/blocks.comp", constants)
        self._row_blocks = -(-target.grid.columns // BLOCK)
        lines = target.band_rows * target.rig.views
        block = dtype("Block").itemsize
        self._blocks = Buffer(device, "shading blocks", block * self._row_blocks * lines)
        self.work = Buffer(device, "shading blocks", dtype("BlockWork").itemsize)
        self._no_work = np.zeros(1, dtype("BlockWork"))
        self._no_work["groups_z"] = 1

    def __call__(
        self,
        batch: Batch,
        band: Band,
        views: Winners,
        *,
        rows: tuple[int, int] | None = None,
        shown: Buffer | None = None,
    ) -> dict[str, Buffer]:
        """List the blocks; what shaders read of them and the pixels' words, by block name. rows: of
        the band, [first, end), all by default. shown: uint32 [triangle, 2] whose first becomes
        1 where a pixel shows it."""
        first, end = rows or (0, band.rows)
        row_blocks = self._row_blocks * band.target.rig.views
        listed = {"Words": views.words, "Blocks": self._blocks, "BlockWorkBlock": self.work}
        groups = -(-(row_blocks * (end - first)) // _LIST_GROUP)
        across = min(groups, GROUPS_ACROSS)
        self.work.write(self._no_work)
        self._list.set(
            {
                "FrameBlock": band.frame(batch),
                **listed,
                "Eyes": band.target.eyes,
                "RowOffsets": band.target.row_offsets,
                "TriangleTracks": shown or self._blocks,
            },
            {
                "first_block": row_blocks * first,
                "block_count": row_blocks * (end - first),
                "row_blocks": self._row_blocks,
                "groups_across": across,
            },
        )
        self._list.run((across, -(-groups // across), 1))
        return listed

    def release(self) -> None:
        """Free the kernel and the list."""
        for owner in (self._list, self._blocks, self.work):
            owner.release()

"""Binning: where the rows of points on each window row go."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lfd_render.gpu.device import Device
from lfd_render.gpu.memory import Buffer
from lfd_render.gpu.programs import Kernel
from lfd_render.gpu.scene_buffers import Batch
from lfd_render.passes.items import GROUPS_ACROSS, ITEM_STEP, Items
from lfd_render.passes.view_target import Band

_HEADROOM = 1.25  # of the room for a bin over the longest found, as for the sampler's windows
_LANE_TRIANGLES = 64
_LANE_LOOPS = 1 << 15  # half of what llvmpipe allows an invocation


@dataclass
class Bins:
    """A batch's bins, one for each window row of a band. ends: uint32 [row], where each begins and,
    once they are filled, where it ends; longest: uint32, of all since `fit`; room: items of a bin
    that splatting must take."""

    ends: Buffer
    longest: Buffer
    room: int = 0

    @classmethod
    def of(cls, device: Device, rows: int) -> Bins:
        """For bands of so many rows."""
        bins = cls(Buffer(device, "bins", 4 * rows), Buffer(device, "bins", 4))
        bins.longest.fill(0)
        return bins

    def fit(self) -> bool:
        """Make room for the longest bin since the last call.

        Returns whether there was too little, so that what was rendered must be rendered again.
        Waits for the device: call it when a frame is done.
        """
        longest = int(self.longest.read(np.uint32)[0])
        self.longest.fill(0)
        if longest <= self.room:
            return False
        self.room = int(longest * _HEADROOM)
        return True

    def release(self) -> None:
        """Free the buffers."""
        self.ends.release()
        self.longest.release()


class Bin:
    """Items, Band → Bins.ends: where the rows of points of each window row begin, for
    `sample/rows.comp` to write them there, by which the ends move on. A counting sort."""

    def __init__(self, device: Device, band_rows: int) -> None:
        each = max(1, min(_LANE_TRIANGLES, _LANE_LOOPS // band_rows))
        self._group = device.lanes * each
        constants = {
            "LANES": device.lanes,
            "GROUP_TRIANGLES": self._group,
            "GROUPS_ACROSS": GROUPS_ACROSS,
            "ITEM_STEP": ITEM_STEP,
        }
        self._count = Kernel(device, "bin/count.comp", constants)
        self._scan = Kernel(device, "bin/scan.comp")

    def __call__(self, batch: Batch, items: Items, bins: Bins, band: Band, window: int) -> None:
        """Count a window's items."""
        bins.ends.fill(0)
        self._count.set(
            {
                "FrameBlock": band.frame(batch),
                "Spans": items.spans,
                "VisibleTriangles": items.visible,
                "WorkBlock": items.work,
                "ItemStarts": items.starts,
                "Bins": bins.ends,
            },
            {"window": window},
        )
        groups = -(-batch.triangles // self._group)
        across = min(groups, GROUPS_ACROSS)
        self._count.run((across, -(-groups // across), 1))
        self._scan.set({"Bins": bins.ends, "Longest": bins.longest})
        self._scan.run((1, 1, 1))

    def release(self) -> None:
        """Free the kernels."""
        self._count.release()
        self._scan.release()

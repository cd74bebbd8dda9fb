"""Binning: rows of points → the same, sorted by window row."""

from __future__ import annotations

import numpy as np

from lfd_render.gpu.device import Device
from lfd_render.gpu.layout import dtype
from lfd_render.gpu.memory import Buffer
from lfd_render.gpu.programs import Kernel
from lfd_render.gpu.scene_buffers import Batch, SceneBuffers
from lfd_render.passes.items import GROUPS_ACROSS, ROWS_DISPATCH
from lfd_render.passes.sample import PointCloud
from lfd_render.passes.view_target import Band, ViewTarget

_HEADROOM = 1.25  # of the room for a bin over the longest found, as for the sampler's windows


class Bin:
    """PointCloud, Band → rows: PointRow [item], sorted by row of the band; ends: uint32 [row].

    A counting sort on the device. The order within a row's bin may differ from run to run.
    """

    def __init__(self, device: Device, scene: SceneBuffers, target: ViewTarget) -> None:
        self._device = device
        constants = {"GROUPS_ACROSS": GROUPS_ACROSS}
        self._count = Kernel(device, "bin/count.comp", constants)
        self._scan = Kernel(device, "bin/scan.comp")
        self._scatter = Kernel(device, "bin/scatter.comp", constants)
        self._index = {batch.triangle_base: i for i, batch in enumerate(scene.batches)}
        self._room = np.zeros(len(scene.batches), np.int64)  # [batch]
        self._longest = Buffer(device, "bins", 4 * len(scene.batches))  # uint32 [batch]
        self._longest.fill(0)
        self.ends = Buffer(device, "bins", 4 * target.band_rows)
        self.rows = Buffer(device, "binned rows", dtype("PointRow").itemsize)

    def __call__(self, batch: Batch, points: PointCloud, band: Band, window: int) -> None:
        """Sort the window of rows that was written last."""
        if self.rows.size < points.rows.size:
            self.rows.release()
            self.rows = Buffer(self._device, "binned rows", points.rows.size)
        self.ends.fill(0)
        items = {
            "FrameBlock": band.frame(batch),
            "PointRows": points.rows,
            "WorkBlock": points.work,
            "Bins": self.ends,
        }
        dispatch = points.work, window * dtype("Work").itemsize + ROWS_DISPATCH
        self._count.set(items, {"window": window})
        self._count.run_indirect(*dispatch)
        self._scan.set(
            {"Bins": self.ends, "Longest": self._longest},
            {"batch": self._index[batch.triangle_base]},
        )
        self._scan.run((1, 1, 1))
        self._scatter.set({**items, "BinnedRows": self.rows}, {"window": window})
        self._scatter.run_indirect(*dispatch)

    def room(self, batch: Batch) -> int:
        """Items of each of a batch's bins that splatting must take."""
        return int(self._room[self._index[batch.triangle_base]])

    def fit(self) -> bool:
        """Make room for the longest bins since the last call.

        Returns whether there was too little, so that what was rendered must be rendered again.
        Waits for the device: call it when a frame is done.
        """
        longest = self._longest.read(np.uint32).astype(np.int64)
        self._longest.fill(0)
        short = longest > self._room
        self._room[short] = longest[short] * _HEADROOM
        return bool(short.any())

    def release(self) -> None:
        """Free the kernels and buffers."""
        for owner in (
            self._count, self._scan, self._scatter, self._longest, self.ends, self.rows,
        ):  # fmt: skip
            owner.release()

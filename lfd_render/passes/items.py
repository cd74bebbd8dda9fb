"""Items: rows of the triangles that can be seen, counted through, in windows that fit a buffer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from lfd_render.gpu.device import Device
from lfd_render.gpu.layout import dtype
from lfd_render.gpu.memory import Buffer
from lfd_render.gpu.programs import Kernel
from lfd_render.gpu.scene_buffers import Batch
from lfd_render.passes.view_target import Band

SEGMENT = 64  # triangles a thread of the prefix sum takes
ITEM_STEP = 64  # items whose triangles are found without a search
GROUP_ROWS = 4  # rows of points a work group of the splatter takes
GROUPS_ACROSS = 32768  # work groups along x before y grows
ROWS_DISPATCH = 12  # byte offset of rows_x within Work
_SEGMENT_GROUP = 64  # local_size_x of sample/sum.comp and sample/compact.comp


@dataclass
class Items:
    """spans: Span [triangle]; visible: Visible [≤ triangles]; work: Work [window]; starts: index in
    `visible` [each ITEM_STEPth item]."""

    spans: Buffer
    visible: Buffer
    segments: Buffer
    most_items: Buffer
    work: Buffer
    starts: Buffer
    window_items: int
    windows: int

    @classmethod
    def of(cls, device: Device, batch: Batch) -> Items:
        """Those of a batch, in one window that is too small until someone widens it."""
        segments = -(-batch.triangles // SEGMENT)
        items = cls(
            spans=Buffer(device, "points", dtype("Span").itemsize * batch.triangles),
            visible=Buffer(device, "points", dtype("Visible").itemsize * batch.triangles),
            segments=Buffer(device, "points", 8 * segments),
            most_items=Buffer(device, "points", 4),
            work=Buffer(device, "points", dtype("Work").itemsize),
            starts=Buffer(device, "points", 4),
            window_items=1,
            windows=1,
        )
        items.most_items.fill(0)
        return items

    def divide(self, device: Device, windows: int, window_items: int) -> None:
        """Choose how many windows there are and what each holds."""
        self.windows, self.window_items = windows, window_items
        self.work.release()
        self.starts.release()
        self.work = Buffer(device, "points", dtype("Work").itemsize * windows)
        self.starts = Buffer(device, "points", 4 * -(-windows * window_items // ITEM_STEP))

    def take_most(self) -> int:
        """The most items of any band since the last call. Waits for the device."""
        most = int(self.most_items.read(np.uint32)[0])
        self.most_items.fill(0)
        return most

    def release(self) -> None:
        """Free the buffers."""
        for buffer in (
            self.spans, self.visible, self.segments, self.most_items, self.work, self.starts,
        ):  # fmt: skip
            buffer.release()


class CountItems:
    """Items.spans → visible triangles in order, the items before each, and Work of each window."""

    def __init__(self, device: Device, view_lanes: int) -> None:
        constants: Mapping[str, int] = {
            "SEGMENT": SEGMENT,
            "ITEM_STEP": ITEM_STEP,
            "GROUP_ROWS": GROUP_ROWS,
            "GROUPS_ACROSS": GROUPS_ACROSS,
        }
        self._view_lanes = view_lanes
        self._sum = Kernel(device, "sample/sum.comp", constants)
        self._scan = Kernel(device, "sample/scan.comp", constants)
        self._compact = Kernel(device, "sample/compact.comp", constants)

    def __call__(self, batch: Batch, items: Items, band: Band) -> None:
        """Count the items of one batch and band, whose spans have been written."""
        frame = {"FrameBlock": band.frame(batch)}
        segments = -(-batch.triangles // SEGMENT)
        groups = (-(-segments // _SEGMENT_GROUP), 1, 1)
        self._sum.set({**frame, "Spans": items.spans, "Segments": items.segments})
        self._sum.run(groups)
        self._scan.set(
            {
                "Segments": items.segments,
                "WorkBlock": items.work,
                "MostItems": items.most_items,
            },
            {
                "segment_count": segments,
                "view_blocks": -(-band.target.rig.views // self._view_lanes),
                "window_items": items.window_items,
            },
        )
        self._scan.run((1, 1, 1))
        self._compact.set(
            {
                **frame,
                "Spans": items.spans,
                "Segments": items.segments,
                "VisibleTriangles": items.visible,
                "ItemStarts": items.starts,
            }
        )
        self._compact.run(groups)

    def release(self) -> None:
        """Free the kernels."""
        for kernel in (self._sum, self._scan, self._compact):
            kernel.release()

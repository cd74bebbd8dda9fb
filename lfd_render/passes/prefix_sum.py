"""Exclusive prefix sums of words on the device."""

from __future__ import annotations

import numpy as np

from lfd_render.gpu.device import Device
from lfd_render.gpu.memory import Buffer
from lfd_render.gpu.programs import Kernel
from lfd_render.passes.items import GROUPS_ACROSS

_SEGMENT = 64  # values a thread takes
_GROUP = 64  # local_size_x of prefix_sum/sum.comp and add.comp


class PrefixSum:
    """Values → the sums of those before each, in place, and `total`: uint32 [2], the sum of all and
    the most that it was since `take_most`; `dispatch` runs a work group for each `group` units of
    the total, GROUPS_ACROSS abreast."""

    def __init__(self, device: Device, *, stride: int = 1, group: int = 64) -> None:
        """stride: words from a value to the next, which is the last of so many."""
        self._device, self._stride = device, stride
        constants = {"SEGMENT": _SEGMENT, "STRIDE": stride}
        self._sum = Kernel(device, "prefix_sum/sum.comp", constants)
        dispatch = {"GROUPS_ACROSS": GROUPS_ACROSS, "GROUP_UNITS": group}
        self._scan = Kernel(device, "prefix_sum/scan.comp", dispatch)
        self._add = Kernel(device, "prefix_sum/add.comp", constants)
        self._segments = Buffer(device, "prefix sums", 4)
        self.total = Buffer(device, "prefix sums", 8)
        self.total.fill(0)
        self.dispatch = Buffer(device, "prefix sums", 12)

    def __call__(self, values: Buffer, limit: Buffer, most_units: int) -> None:
        """Sum the first `limit[0]` values of a buffer, if it holds so many, else all it holds.
        most_units: that `dispatch` runs work groups for."""
        capacity = values.size // (4 * self._stride)
        segments = -(-capacity // _SEGMENT)
        if self._segments.size != 4 * segments:
            self._segments.release()
            self._segments = Buffer(self._device, "prefix sums", 4 * segments)
        groups = (-(-segments // _GROUP), 1, 1)
        buffers = {"Values": values, "Segments": self._segments, "Limit": limit}
        self._sum.set(buffers, {"capacity": capacity})
        self._sum.run(groups)
        self._scan.set(
            {"Segments": self._segments, "Total": self.total, "Dispatch": self.dispatch},
            {"most_units": most_units},
        )
        self._scan.run((1, 1, 1))
        self._add.set(buffers, {"capacity": capacity})
        self._add.run(groups)

    def take_most(self) -> int:
        """The largest total since the last call. Waits for the device."""
        most = int(self.total.read(np.uint32)[1])
        self.total.fill(0)
        return most

    def release(self) -> None:
        """Free kernels and buffers."""
        for owner in (
            self._sum,
            self._scan,
            self._add,
            self._segments,
            self.total,
            self.dispatch,
        ):
            owner.release()

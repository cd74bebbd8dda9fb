"""The winner of each view pixel of a band, [row of the band, view, column].

Two layouts of the same thing, by the width of the words that winners are compared by.
"""

from __future__ import annotations

from typing import Protocol

from lfd_render.errors import UnsupportedError
from lfd_render.gpu.device import Device
from lfd_render.gpu.layout import CONSTANTS
from lfd_render.gpu.memory import Buffer
from lfd_render.gpu.programs import Kernel
from lfd_render.passes.items import GROUPS_ACROSS
from lfd_render.passes.view_target import ViewTarget

INT64 = "GL_ARB_gpu_shader_int64"
INT64_ATOMICS = "GL_NV_shader_atomic_int64"
WINNERS = ("auto", "int64", "two-pass", "owned")  # ways to find them, all with the same result
_FARTHEST = 0x7F800000  # +∞ as a float's bits
_GROUP = 64  # local_size_x of splat/forget.comp


def choose_winners(device: Device, wanted: str, *, ownable: bool = True) -> str:
    """What a member of WINNERS comes to on a device: int64, two-pass or owned.

    auto: 64-bit atomics where there are some; else owned rows on software devices, where they take
    a third of two passes' time (docs/performance.md); else two passes. ownable: points come in
    rows that all views share. Raises UnsupportedError where the device lacks what it takes.
    """
    assert wanted in WINNERS
    can = {
        name: extension in device.info.extensions
        for name, extension in (("int64", INT64_ATOMICS), ("owned", INT64))
    }
    if not can.get(wanted, True):
        lacking = INT64_ATOMICS if wanted == "int64" else INT64
        raise UnsupportedError(
            f"splat '{wanted}': {device.name} lacks {lacking}; use two-pass or auto, "
            "which give the same picture"
        )
    if wanted != "auto":
        return wanted
    if can["int64"]:
        return "int64"
    return "owned" if can["owned"] and device.info.software and ownable else "two-pass"


class Winners(Protocol):
    """Global triangle ids or NO_TRIANGLE, each `word_stride` words of `words` apart."""

    words: Buffer
    word_stride: int


class ViewBuffers(Winners, Protocol):
    """Winners, and how near they are: each depth the last of `word_stride` words of `depths`."""

    depths: Buffer

    def blocks(self) -> dict[str, Buffer]:
        """What splatting writes, by block name."""

    def clear(self) -> None:
        """Set all pixels to nothing, infinitely far."""

    def clear_words(self) -> None:
        """Forget the winners and keep the depths, for surfaces that lie over what was drawn."""

    def release(self) -> None:
        """Free the buffers."""


class SplitViewBuffers:
    """Depths as float bits, and ids, apart: for two passes of 32-bit atomics."""

    word_stride = 1

    def __init__(self, device: Device, target: ViewTarget) -> None:
        self.depths = Buffer(device, "view buffers", 4 * target.band_pixels)
        self.words = Buffer(device, "view buffers", 4 * target.band_pixels)

    def blocks(self) -> dict[str, Buffer]:
        """What splatting writes, by block name."""
        return {"Depths": self.depths, "Words": self.words}

    def clear(self) -> None:
        """Set all pixels to nothing, infinitely far."""
        self.depths.fill(_FARTHEST)
        self.clear_words()

    def clear_words(self) -> None:
        """Forget the winners and keep the depths."""
        self.words.fill(CONSTANTS["NO_TRIANGLE"])

    def release(self) -> None:
        """Free the buffers."""
        self.depths.release()
        self.words.release()


class PackedViewBuffers:
    """Depth above id in one 64-bit word: for 64-bit atomics, and for owners of rows."""

    word_stride = 2

    def __init__(self, device: Device, target: ViewTarget) -> None:
        self._pixels = target.band_pixels
        self.words = self.depths = Buffer(
            device,
            "view buffers",
            8 * (self._pixels + self._pixels % 2),  # two are fetched at once
        )
        self._forget = Kernel(device, "splat/forget.comp")

    def blocks(self) -> dict[str, Buffer]:
        """What splatting writes, by block name."""
        return {"Winners": self.words}

    def clear(self) -> None:
        """Set all pixels to nothing, farther than any depth."""
        self.words.fill(CONSTANTS["NO_TRIANGLE"])

    def clear_words(self) -> None:
        """Forget the winners and keep the depths."""
        groups = -(-self._pixels // _GROUP)
        across = min(groups, GROUPS_ACROSS)
        self._forget.set({"Winners": self.words}, {"pixels": self._pixels, "groups_across": across})
        self._forget.run((across, -(-groups // across), 1))

    def release(self) -> None:
        """Free the buffer and the kernel."""
        self.words.release()
        self._forget.release()


def make_view_buffers(device: Device, target: ViewTarget, winners: str) -> ViewBuffers:
    """The layout for a way to find winners, of WINNERS but auto."""
    return (SplitViewBuffers if winners == "two-pass" else PackedViewBuffers)(device, target)

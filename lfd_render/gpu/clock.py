"""Honest stage times: wall clock between finishes.

On llvmpipe GL_TIME_ELAPSED reads 1e-6 ms for a dispatch of 137 ms, and moderngl's queries are
32-bit nanoseconds that wrap at 4.29 s, so no query is used.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lfd_render.gpu.device import Device


class StageClock:
    """Milliseconds by stage, summed where a stage runs more than once in a frame."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self.stages_ms: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time what runs inside, from an idle device to an idle device."""
        self._device.finish()
        start = time.perf_counter()
        yield
        self._device.finish()
        elapsed = 1000.0 * (time.perf_counter() - start)
        self.stages_ms[name] = self.stages_ms.get(name, 0.0) + elapsed

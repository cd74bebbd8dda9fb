"""Frames of one technique, from camera to encoded panel image, and their timings."""

from __future__ import annotations

import statistics
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import DisplayProfile, ViewGrid
from lfd_render.gpu.clock import StageClock
from lfd_render.gpu.device import Device
from lfd_render.panel.stage import PanelOptions, PanelStage
from lfd_render.passes.placement import Placement
from lfd_render.techniques import Technique

_FRAMES = 1024  # timed at most
Progress = Callable[[float], None]  # told the part that is done, 0 to 1


@dataclass
class Timings:
    """Milliseconds: what is done once, and the stages and whole of each of the last frames."""

    once: dict[str, float] = field(default_factory=dict)
    frames: deque[tuple[float, dict[str, float]]] = field(
        default_factory=lambda: deque(maxlen=_FRAMES)
    )

    def measure(self, name: str, device: Device, work: Callable[[], Any]) -> Any:
        """Run something once, timed to an idle device."""
        start = time.perf_counter()
        result = work()
        device.finish()
        self.once[name] = self.once.get(name, 0.0) + 1000.0 * (time.perf_counter() - start)
        return result

    def summary(self) -> dict[str, float]:
        """The median frame's whole and stages beside what was done once, in ms."""
        order = sorted(self.frames, key=lambda frame: frame[0])
        stages = order[(len(order) - 1) // 2][1] if order else {}
        frame = {"frame": statistics.median(f[0] for f in order)} if order else {}
        return {key: round(ms, 3) for key, ms in {**self.once, **stages, **frame}.items()}


class PanelFrames:
    """Frames of one technique, from camera to encoded panel image."""

    def __init__(
        self,
        device: Device,
        technique: Technique,
        display: DisplayProfile,
        grid: ViewGrid,
        options: PanelOptions,
    ) -> None:
        self.technique = technique
        self._device = device
        self._panel = PanelStage(device, display, grid, technique.target, options)

    def warm_up(self, placement: Placement) -> None:
        """Run a little of everything: a software device compiles shaders when they first run."""
        clock = StageClock(self._device)
        self.technique.begin(placement, clock)
        self.technique.warm_up(clock)
        self._panel.band(self.technique.target.warm_up_band, clock, placement.exposure)
        self._panel.finish(clock, placement.exposure)

    def run(self, placement: Placement, progress: Progress) -> tuple[float, dict[str, float]]:
        """One frame: its milliseconds, whole and by stage. progress: told the part that is done."""
        complete = False
        while not complete:
            clock = StageClock(self._device)
            self._device.finish()
            start = time.perf_counter()
            self.technique.begin(placement, clock)
            bands = self.technique.target.bands
            for index, band in enumerate(bands):
                self.technique.render(band, clock)
                self._panel.band(band, clock, placement.exposure)
                progress((index + 1) / len(bands))
            self._panel.finish(clock, placement.exposure)
            self._device.finish()
            elapsed_ms = 1000.0 * (time.perf_counter() - start)
            complete = self.technique.complete()
        return elapsed_ms, clock.stages_ms

    def read(self) -> tuple[NDArray[np.float16] | None, NDArray[np.uint8]]:
        """The last frame in linear light, if asked for, and encoded."""
        return self._panel.read()

    def release(self) -> None:
        """Free everything, the technique included."""
        for owner in (self.technique, self._panel):
            owner.release()

"""What every technique is: passes in order over a view target, each a named stage."""

from __future__ import annotations

from typing import Protocol

from lfd_render.gpu.clock import StageClock
from lfd_render.passes.placement import Placement
from lfd_render.passes.view_target import Band, ViewTarget


class Technique(Protocol):
    """Fills view images, band by band."""

    target: ViewTarget

    @property
    def winners(self) -> str | None:
        """How points' winners are found; None where nothing is splatted."""
        ...

    def begin(self, placement: Placement, clock: StageClock) -> None:
        """Start a frame: place the scene."""

    def warm_up(self, clock: StageClock) -> None:
        """Run all shaders once on little work, and make room for the points of this placement."""

    def render(self, band: Band, clock: StageClock) -> None:
        """Fill target.images with one band."""

    def complete(self) -> bool:
        """Whether the frame just rendered is whole; if not, render it again, now with room for all.

        Waits for the device."""
        ...

    def count_points(self) -> int:
        """Points of a whole frame at the last placement; 0 where there are none."""
        ...

    def release(self) -> None:
        """Free what the technique owns, its target included."""

"""What every technique is: passes in order over a view target, each a named stage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from lfd_render.gpu.clock import StageClock
from lfd_render.passes.placement import Placement
from lfd_render.passes.sampling import Sampling
from lfd_render.passes.view_target import Band, ViewTarget


@dataclass(frozen=True)
class Effort:
    """What a frame took. pairs_tried: pixels that points tried in the views that their triangles
    face, at least one for each point and view (for each row of points and view, where rows are
    what is splatted); pairs_kept: those inside their triangle and opaque; visible_pixels: of all
    views, those that show something."""

    points: int = 0
    pairs_tried: int = 0
    pairs_kept: int = 0
    visible_pixels: int = 0


class Technique(Protocol):
    """Fills view images, band by band."""

    target: ViewTarget

    @property
    def winners(self) -> str | None:
        """How points' winners are found; None where nothing is splatted."""
        ...

    @property
    def sampling(self) -> Sampling | None:
        """How points are made and shaded, all of it settled; None where there are none."""
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

    def effort(self) -> Effort:
        """What a frame at the last placement takes; nothing where there are no points."""
        ...

    def release(self) -> None:
        """Free what the technique owns, its target included."""

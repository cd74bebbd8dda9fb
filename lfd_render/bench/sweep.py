"""What an eye sees that moves by a part of a view interval from frame to frame, through the virtual
panel. What single views cannot tell of shows here: views that jump, and pictures that are double
between two of them.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import DisplayProfile, Rig, eye_from_slot
from lfd_render.panel.look import look_from
from lfd_render.quality import flip

Pixels = NDArray[np.uint8]
STEP = 0.125  # of a view interval
_ASIDE = 4  # intervals off the middle, so that depth shows


@dataclass(frozen=True)
class Sweep:
    """Eyes at the viewing distance, and ordinary pictures from there."""

    eye_x_mm: NDArray[np.float64]
    pictures: tuple[Pixels, ...]


def make_sweep(display: DisplayProfile, frames: int, standard: Callable[[Rig], Pixels]) -> Sweep:
    """So many eyes. standard: the picture of a rig of one."""
    slots = (display.views // 2 + _ASIDE + STEP * np.arange(frames)) / display.views - 0.5
    eyes, distance = eye_from_slot(slots, display), display.distance_mm
    rigs = [Rig(eyes[i : i + 1], distance, display.size_mm, 0.05 * distance) for i in range(frames)]
    return Sweep(eyes, tuple(standard(rig) for rig in rigs))


def sweep_errors(eia: Pixels, display: DisplayProfile, sweep: Sweep) -> tuple[float, float]:
    """Mean FLIP of what the virtual panel shows, without crosstalk, and RMSE of how it changes.

    Raises UsageError without flip-evaluator.
    """
    height, width = sweep.pictures[0].shape[:2]
    seen = [
        look_from(eia, display, (float(x), 0.0, display.distance_mm), size_px=(width, height),
                  sigma_views=0.0)
        for x in sweep.eye_x_mm
    ]  # fmt: skip
    degrees = 2 * math.degrees(math.atan(0.5 * display.size_mm[0] / display.distance_mm))
    pairs = zip(sweep.pictures, seen, strict=True)
    return (
        statistics.fmean(flip(true, found, width / degrees) for true, found in pairs),
        change_error(sweep.pictures, seen),
    )


def change_error(true: Sequence[Pixels], seen: Sequence[Pixels]) -> float:
    """RMSE of the changes from frame to frame, in levels."""
    wanted, found = (np.diff(np.stack(frames).astype(np.int16), axis=0) for frames in (true, seen))
    return float(np.sqrt(np.mean((found - wanted).astype(np.float64) ** 2)))

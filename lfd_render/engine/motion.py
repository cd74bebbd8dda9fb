"""How the window moves before a scene, by the time that a frame shows."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

from lfd_render.engine.choices import Choices
from lfd_render.errors import OptionError

Kind = Literal["orbit", "sway", "dolly"]


@dataclass(frozen=True)
class Motion:
    """orbit: the scene turns round; sway: it turns to and fro, by `swing` degrees to either side;
    dolly: the window goes into the scene and back out of it, by `travel` of its heights to either
    side. Each comes round again after so many seconds. Raises OptionError."""

    kind: Kind
    period: float = 12.0
    swing: float = 15.0
    travel: float = 0.25

    def __post_init__(self) -> None:
        """Check ranges."""
        if not 0 < self.period < math.inf:
            raise OptionError("period", f"{self.period}; give seconds above 0")
        if not 0 <= self.swing < 90:
            raise OptionError("swing", f"{self.swing}; give degrees from 0 to below 90")
        if not 0 <= self.travel < math.inf:
            raise OptionError("travel", f"{self.travel}; give window heights from 0")

    def at(self, choices: Choices, seconds: float) -> Choices:
        """The choices of the picture at a time."""
        match self.kind:
            case "orbit":
                return replace(choices, yaw=choices.yaw + turned(seconds, self.period))
            case "sway":
                away = self.swing * to_and_fro(seconds, self.period)
                return replace(choices, yaw=choices.yaw + away)
            case "dolly":
                away = self.travel * to_and_fro(seconds, self.period)
                return replace(choices, dolly=choices.dolly + away)


def turned(seconds: float, period: float) -> float:
    """Degrees of a full turn."""
    return 360.0 * (seconds / period % 1.0)


def to_and_fro(seconds: float, period: float) -> float:
    """From −1 to 1 and back, 0 at first."""
    return math.sin(math.radians(turned(seconds, period)))

"""Where the eyes stand that look at a panel, as the command line and HTTP name them."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lfd_render.errors import OptionError

if TYPE_CHECKING:
    from lfd_render.display import DisplayProfile

MOST_STEPS = 1000
EYES_APART_MM = 64.0
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?"

Eye = tuple[float, float, float]


@dataclass(frozen=True)
class Stand:
    """Where a person stands: the point between the eyes, in mm, and how to say it."""

    eye_mm: Eye
    said: str

    def eyes(self, apart_mm: float | None) -> list[Eye]:
        """One eye there, or two so far apart, left first."""
        if apart_mm is None:
            return [self.eye_mm]
        x, y, z = self.eye_mm
        return [(x - apart_mm / 2, y, z), (x + apart_mm / 2, y, z)]


def stands(
    profile: DisplayProfile, angle: float | None, eye: str | None, sweep: str | None
) -> list[Stand]:
    """The places of exactly one of angle, eye and sweep. Raises OptionError."""
    given = [name for name, value in (("angle", angle), ("eye", eye), ("sweep", sweep))
             if value is not None]  # fmt: skip
    if len(given) != 1:
        got = " and ".join(given) or "none of them"
        raise OptionError("angle", f"give one of angle, eye and sweep; got {got}")
    if angle is not None:
        return [_at_angle(profile, angle, "angle")]
    if eye is not None:
        return [_at_eye(eye)]
    assert sweep is not None
    start, end, steps = _parse_sweep(sweep)
    return [
        _at_angle(profile, start + (end - start) * step / (steps - 1), "sweep")
        for step in range(steps)
    ]


def _at_angle(profile: DisplayProfile, angle_deg: float, option: str) -> Stand:
    if not abs(angle_deg) < 90:
        raise OptionError(option, f"{angle_deg:g} degrees; give angles between -90 and 90")
    x = profile.distance_mm * math.tan(math.radians(angle_deg))
    return Stand((x, 0.0, profile.distance_mm), f"{angle_deg:g}°")


def _at_eye(text: str) -> Stand:
    match = re.fullmatch(rf"({_NUMBER}),({_NUMBER}),({_NUMBER})", text.strip().lower())
    if not match:
        raise OptionError("eye", f"'{text}'; give X,Y,Z in mm, as 50,0,600")
    x, y, z = (float(part) for part in match.groups())
    if not z > 0:
        raise OptionError(
            "eye", f"'{text}'; z is {z:g} mm, behind the panel or in it, give a z above 0"
        )
    return Stand((x, y, z), f"({x:g}, {y:g}, {z:g}) mm")


def _parse_sweep(text: str) -> tuple[float, float, int]:
    match = re.fullmatch(rf"({_NUMBER}):({_NUMBER}):(\d{{1,4}})", text.strip().lower())
    if not match or not 2 <= int(match[3]) <= MOST_STEPS:
        raise OptionError(
            "sweep", f"'{text}'; give FROM:TO:N, degrees and 2 to {MOST_STEPS} steps, as -15:15:7"
        )
    return float(match[1]), float(match[2]), int(match[3])

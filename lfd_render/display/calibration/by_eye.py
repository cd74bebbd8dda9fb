"""Calibration by eye: one number of the lenses after the other, until a pattern is evenly lit."""

from __future__ import annotations

import math

from lfd_render.display.profile import DisplayProfile
from lfd_render.errors import UsageError

FIELDS = ("lens_count", "tilt_deg", "center")


def adjusted(profile: DisplayProfile, field: str, value: float) -> DisplayProfile:
    """The profile with another lens_count, tilt_deg or center.

    Count and tilt keep the phase at the panel's middle, where the eye is: fringes open and close
    about it. Raises ProfileError for a value that is out of range.
    """
    if field not in FIELDS:
        raise UsageError(f"field '{field}': unknown; use {', '.join(FIELDS)}")
    lens = profile.lens
    count, drift, center = lens.lens_count, lens.drift, lens.center
    middle = count * (1 + drift) / 2 - center
    if field == "center":
        center = value
    else:
        width, height = profile.size_mm
        if field == "lens_count":
            count = value
        else:
            drift = height / width * math.tan(math.radians(value))
        center = count * (1 + drift) / 2 - middle
        center -= round(center - lens.center)
    changed = lens.model_copy(update={"lens_count": count, "drift": drift, "center": center})
    # Through its text, so that whatever is out of range is said as for any profile.
    text = profile.model_copy(update={"lens": changed}).to_json()
    return DisplayProfile.from_json(text, source=f"{field} {value:g}")


def finished(profile: DisplayProfile, name: str | None) -> DisplayProfile:
    """The profile as this unit's own, with what was adjusted no longer assumed."""
    provenance = profile.provenance
    by_hand = ("lens.lens_count", "lens.drift", "lens.tilt", "lens.center")
    assumed = tuple(a for a in provenance.assumed if not a.startswith(by_hand))
    return profile.model_copy(
        update={
            "name": name or f"{profile.name}-by-eye",
            "provenance": provenance.model_copy(
                update={
                    "source": f"adjusted by eye from {profile.name}"[:2000],
                    "template": False,
                    "assumed": assumed,
                }
            ),
        }
    )

"""Figures that a profile may have, but hardly any display has: what was meant otherwise."""

from __future__ import annotations

import math

from lfd_render.display.profile import DisplayProfile


def doubts(profile: DisplayProfile) -> list[str]:
    """One line for each figure that is hardly meant, with what it may be instead."""
    found = []
    width, height = profile.resolution_px
    pixel = [mm / px for mm, px in zip(profile.size_mm, (width, height), strict=True)]
    if not 0.9 < pixel[0] / pixel[1] < 1.1:
        found.append(
            f"panel.size_mm makes pixels of {pixel[0]:.4g} x {pixel[1]:.4g} mm; are width and "
            "height those of this resolution?"
        )
    if profile.distance_mm < 50:
        found.append(
            f"viewing.distance_mm is {profile.distance_mm:g}; in metres it would be "
            f"{1000 * profile.distance_mm:g} mm"
        )
    if profile.lens_count > width / 1.5:
        found.append(
            f"lens.lens_count is {profile.lens_count:g}, {width / profile.lens_count:.2g} pixels a "
            "lens, too few for views"
        )
    cone = gap_cone_deg(profile)
    if cone is not None and not 0.5 < cone / profile.viewing.cone_deg < 2:
        found.append(
            f"lens.gap_mm is {profile.lens.gap_mm:g}, which makes a cone of {cone:.3g} degrees; "
            f"viewing.cone_deg is {profile.viewing.cone_deg:g}"
        )
    if profile.viewing.cone_deg < 2:
        found.append(f"viewing.cone_deg is {profile.viewing.cone_deg:g}; is it in radians?")
    return found


def gap_cone_deg(profile: DisplayProfile) -> float | None:
    """2·asin(n·sin(atan(p_h/(2t)))), 180 where light is reflected inside; None without a gap."""
    sheet, gap = profile.physical_lens_count, profile.lens.gap_mm
    if sheet is None or gap is None:
        return None
    sine = profile.index * math.sin(math.atan(profile.size_mm[0] / sheet / (2 * gap)))
    return 180.0 if sine >= 1 else math.degrees(2 * math.asin(sine))

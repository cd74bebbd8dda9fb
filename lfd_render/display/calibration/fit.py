"""Photographs of phase-shifted patterns → a profile with error bars, or a refusal.

Each set is taken from one place: the patterns that `patterns.phase_steps` gives for a guess, seen
by a camera before the panel's middle at a known distance, or off it by a known offset. From the
plane of the fringes (`beat`) follow lens count, drift and center, from the differences of the
colours the subpixels' places. Two distances part gap from pitch: 1/P = (1 + t/(n·Z))/P_sheet.

Assumed: one camera that stands still within a set, exposure and white balance locked, a response
near sRGB, the panel's own near sRGB too. What a camera's lens distorts moves fringes only as far as
there are fringes: fit again from patterns of the profile found, and it is gone.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from lfd_render.display.calibration.corners import Float64
from lfd_render.display.calibration.correction import correction_of
from lfd_render.display.calibration.measure import Measured, PhotoSet, measure, offsets_px
from lfd_render.display.model import Cells, Provenance, Response, Stripes, Uncertainty
from lfd_render.display.patterns import COLOURS
from lfd_render.display.profile import DisplayProfile
from lfd_render.display.rig import slot_from_eye
from lfd_render.errors import PictureError, UsageError

STRIPE_DOUBT_PX = 0.01  # subpixels this near to plain stripes are plain stripes


@dataclass(frozen=True, eq=False)
class Fit:
    """What photographs say of a display.

    profile: with `uncertainty`. residual_views: phases that the plane leaves, [row, column] of
    blocks from the top, positive where the eye sees a view from farther right than the profile
    says; NaN where nothing was measured. doubts: standard uncertainty by field, further ones
    included. report: the numbers, for people and programs.
    """

    profile: DisplayProfile
    residual_views: Float64
    doubts: dict[str, float]
    report: dict[str, Any] = field(default_factory=dict)


def fit(
    sets: Sequence[PhotoSet],
    guess: DisplayProfile,
    name: str | None = None,
    *,
    correction: bool = False,
) -> Fit:
    """The profile that the photographs show, `guess` being that which the patterns were made for.

    One set, or two from different distances. `correction`: whether what the lattice leaves of the
    phases, smoothed, becomes the profile's correction. Raises PictureError where the photographs do
    not determine the lenses, UsageError where sets contradict each other.
    """
    if not 1 <= len(sets) <= 2:
        raise UsageError(f"fit: {len(sets)} sets of photographs; give one, or two from 2 distances")
    measured = [measure(one, guess) for one in sets]
    here = min(measured, key=lambda m: abs(m.distance_mm - guess.distance_mm))
    gap, gap_doubt = guess.lens.gap_mm, None
    if len(measured) == 2:
        gap, gap_doubt = _gap(measured, guess, sets)
    shots = sum(len(one.shots) for one in sets)
    found = _assemble(here, guess, gap=gap, gap_doubt=gap_doubt, name=name, shots=shots)
    return _corrected(found, here, guess) if correction else found


def _gap(
    measured: Sequence[Measured], guess: DisplayProfile, sets: Sequence[PhotoSet]
) -> tuple[float, float]:
    """Gap and its standard uncertainty, from the lens counts seen at two distances."""
    near, far = sorted(measured, key=lambda m: m.distance_mm)
    names = " and ".join(s.name for s in sets)
    if far.distance_mm < 1.1 * near.distance_mm:
        raise UsageError(
            f"{names}: taken from {near.distance_mm:g} and {far.distance_mm:g} mm; a gap needs "
            "distances at least a tenth apart, give each set's own"
        )
    counts = [m.seen(guess).lens_count for m in (near, far)]
    doubts = [math.sqrt(m.covariance[0, 0]) for m in (near, far)]
    widths, inverse = [1 / count for count in counts], [1 / m.distance_mm for m in (near, far)]
    slope = (widths[0] - widths[1]) / (inverse[0] - inverse[1])
    period = widths[1] - slope * inverse[1]
    gap = guess.index * slope / period
    spread = math.hypot(*(d / c**2 for d, c in zip(doubts, counts, strict=True)))
    doubt = guess.index * spread / (inverse[0] - inverse[1]) / period
    if not gap > 2 * doubt:
        raise PictureError(
            f"{names}: the gap comes out as {gap:.3g} ± {doubt:.2g} mm; check the distances "
            f"({near.distance_mm:g} and {far.distance_mm:g} mm), or fit each set by itself"
        )
    return gap, doubt


def _assemble(
    here: Measured,
    guess: DisplayProfile,
    *,
    gap: float | None,
    gap_doubt: float | None,
    name: str | None,
    shots: int,
) -> Fit:
    seen = here.seen(guess)
    count, drift = seen.lens_count, seen.drift
    width, height = guess.size_mm
    lean = drift * width / height
    stretched, distance = 1.0, guess.distance_mm
    if here.distance_mm != guess.distance_mm:
        if gap is None:
            distance = here.distance_mm
        else:
            depth = gap / guess.index
            stretched = (1 + depth / here.distance_mm) / (1 + depth / guess.distance_mm)
    final = count * stretched

    # What the camera saw in the panel's middle, and where it would have seen it from before it.
    guess_middle = guess.lens_count * (1 + guess.drift) / 2 - guess.center
    aside = (here.offset_mm[0] + here.offset_mm[1] * lean) * guess.distance_mm / here.distance_mm
    slot = float(slot_from_eye(np.array(aside), guess))
    slot = -slot if guess.viewing.inverted else slot
    subpixels, offset_px, doubts_px = _subpixels(here, guess, count)
    weights, values, measured = [], [], here.middle(guess)
    for group, colour in enumerate(here.colours):
        moved = (offsets_px(guess.panel.subpixels, guess)[colour] * guess.lens_count
                 - offset_px[colour] * count) / guess.resolution_px[0]  # fmt: skip
        weights.append(1 / here.covariance[2 + group, 2 + group])
        values.append(float(measured[group]) - moved)
    if isinstance(subpixels, Stripes):
        middle = values[0] + float(
            np.average([(v - values[0] + 0.5) % 1 - 0.5 for v in values], weights=weights)
        )
    else:
        middle = values[0]  # offsets are such that all agree
    phase = guess_middle - float(middle) - slot
    center = final * (1 + drift) / 2 - phase
    center += round(guess.center - center)

    share = (
        np.array(weights) / sum(weights)
        if isinstance(subpixels, Stripes)
        else np.eye(1, len(weights))[0]
    )
    doubts = _doubts(here, count, drift, share, stretched)
    if gap_doubt is not None and gap is not None:
        doubts["gap_mm"] = gap_doubt
    sigma_views = list(guess.response.sigma_views)
    in_views = guess.views * count / guess.lens_count  # patterns have the guess's lenses
    for colour, (sigma, doubt) in here.sigma.items():
        sigma_views[colour] = sigma * in_views
        doubts[f"sigma_views.{COLOURS[colour]}"] = doubt * in_views
    doubts |= {f"offsets_px.{COLOURS[c]}": value for c, value in doubts_px.items()}

    assumed = _still_assumed(guess, gap_doubt is not None)
    known = {key: value for key, value in doubts.items() if key in Uncertainty.model_fields}
    for key in ("offsets_px", "sigma_views"):
        each = [value for name, value in doubts.items() if name.startswith(f"{key}.")]
        known |= {key: max(each)} if each else {}
    lens = guess.lens.model_copy(
        update={"lens_count": final, "drift": drift, "center": center, "gap_mm": gap}
    )
    fields = {key: getattr(guess, key) for key in type(guess).model_fields} | {
        "name": name or f"{guess.name}-fitted",
        "panel": guess.panel.model_copy(update={"subpixels": subpixels}),
        "lens": lens,
        "viewing": guess.viewing.model_copy(update={"distance_mm": distance}),
        "response": Response(kind="gaussian", sigma_views=_triple(sigma_views)),
        "provenance": Provenance(
            source=f"fitted to {shots} photographs of patterns made for {guess.name}",
            template=False,
            assumed=assumed,
        ),
        "uncertainty": Uncertainty(**known),
    }
    profile = DisplayProfile(**fields)
    residual = _residual_views(here, -guess.views if guess.viewing.inverted else guess.views)
    a, b = here.beat.slopes
    report = {
        "lens_count": final,
        "tilt_deg": math.degrees(profile.tilt_rad),
        "drift": drift,
        "center": center,
        "gap_mm": gap,
        "offsets_px": {COLOURS[c]: offset_px[c] for c in here.colours},
        "sigma_views": {COLOURS[c]: sigma_views[c] for c in here.sigma},
        "uncertainty": doubts,
        "fringes": [a, b],
        "modulation": here.modulation,
        "residual_rms_views": float(np.sqrt(np.nanmean(residual**2))),
        "residual_max_views": float(np.nanmax(np.abs(residual))),
        "corners_px": [[round(float(c), 3) for c in xy] for xy in here.corners.xy_px],
        "photographs": shots,
    }
    return Fit(profile, residual, doubts, report)


def _corrected(found: Fit, here: Measured, guess: DisplayProfile) -> Fit:
    """The fit with a correction of its residuals."""
    sign = -1 if guess.viewing.inverted else 1
    lenses = sign * found.residual_views.ravel() / guess.views
    stated, doubt = correction_of(lenses, here.blocks.u, here.blocks.v, guess)
    known = found.profile.uncertainty
    assert known is not None
    update = {
        "correction": stated,
        "uncertainty": known.model_copy(update={"phase_lenses": doubt}),
    }
    report = found.report | {
        "correction_max_views": guess.views * float(np.abs(stated.phase_lenses).max())
    }
    doubts = found.doubts | {"phase_lenses": doubt}
    report["uncertainty"] = doubts
    return Fit(found.profile.model_copy(update=update), found.residual_views, doubts, report)


def _residual_views(here: Measured, views: int) -> Float64:
    """What the plane leaves of each block, the mean of the colours, [row, column]."""
    counted = np.isfinite(here.beat.residual)
    total = np.where(counted, here.beat.residual, 0).sum(axis=0)
    mean = np.where(counted.any(axis=0), total / counted.sum(axis=0).clip(1), np.nan)
    return np.asarray(-views * mean.reshape(here.blocks.grid), np.float64)


def _doubts(
    here: Measured, count: float, drift: float, share: Float64, stretched: float
) -> dict[str, float]:
    """Standard uncertainties of P, T, tilt's own T and center, by the chain rule."""
    covariance = here.covariance
    across = np.zeros(len(covariance))
    across[0] = -stretched
    # T = (b_g − b)/P: ∂T/∂a = T/P, ∂T/∂b = −1/P.
    lean = np.zeros(len(covariance))
    lean[:2] = drift / count, -1 / count
    # center = P·(1 + T)/2 − phase at the middle.
    center = stretched * np.concatenate([[-0.5, -0.5], np.zeros(len(share))])
    center[2:] = share
    return {
        name: float(np.sqrt(g @ covariance @ g))
        for name, g in (("lens_count", across), ("drift", lean), ("center", center))
    }


def _subpixels(
    here: Measured, guess: DisplayProfile, count: float
) -> tuple[Stripes | Cells, list[float], dict[int, float]]:
    """Layout that the colours show, offsets in pixels from the origin, and their uncertainties.

    d_c = center − center_g + (off_g·P_g − off·P)/W for each colour c.
    """
    known = list(offsets_px(guess.panel.subpixels, guess))
    if len(here.colours) < 2:
        return guess.panel.subpixels, known, {}
    width = guess.resolution_px[0]
    first, middle = here.colours[0], here.middle(guess)
    found, doubts = list(known), {}
    for group, colour in enumerate(here.colours[1:], start=1):
        apart = float(middle[group] - middle[0])
        wanted = (known[colour] - known[first]) * guess.lens_count / width - apart
        wanted = (wanted + 0.5) % 1 - 0.5  # lenses; a whole one looks the same
        found[colour] = float(known[first] + wanted * width / count)
        pick = np.zeros(len(here.covariance))
        pick[2], pick[2 + group] = -1, 1
        doubts[colour] = float(np.sqrt(pick @ here.covariance @ pick)) * width / count
    layouts: list[Stripes | Cells] = [guess.panel.subpixels]
    if isinstance(guess.panel.subpixels, Stripes):
        other: Any = "bgr" if guess.panel.subpixels.order == "rgb" else "rgb"
        layouts.append(guess.panel.subpixels.model_copy(update={"order": other}))
    for layout in layouts:
        places = offsets_px(layout, guess)
        misses = [
            abs(_nearest(found[c] - found[first] - places[c] + places[first], width / count))
            <= max(STRIPE_DOUBT_PX, 3 * doubts[c])
            for c in here.colours[1:]
        ]
        if all(misses):
            return layout, list(places), doubts
    return _cells(guess, [f - k for f, k in zip(found, known, strict=True)]), found, doubts


def _nearest(offset: float, period: float) -> float:
    return offset - period * round(offset / period)


def _cells(guess: DisplayProfile, moved: list[float]) -> Cells:
    """The guess's subpixels, each colour moved to the right."""
    subpixels = guess.panel.subpixels
    mode, offsets = 0, np.array([[(o, 0.0) for o in offsets_px(subpixels, guess)]])
    if isinstance(subpixels, Cells):
        mode, offsets = subpixels.pattern_mode, np.array(subpixels.offsets_px)
    offsets[..., 0] += moved
    kinds = tuple(tuple((float(x), float(y)) for x, y in kind) for kind in offsets)
    return Cells(layout="cells", pattern_mode=mode, offsets_px=kinds)  # type: ignore[arg-type] # three colours each


def _still_assumed(guess: DisplayProfile, with_gap: bool) -> tuple[str, ...]:
    measured: tuple[str, ...] = ("lens.lens_count", "lens.drift", "lens.tilt", "lens.center")
    measured += ("lens.gap_mm",) if with_gap else ()
    return tuple(a for a in guess.provenance.assumed if not a.startswith(measured))


def _triple(values: list[float]) -> tuple[float, float, float]:
    red, green, blue = values
    return red, green, blue

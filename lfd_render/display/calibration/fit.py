"""Photographs of phase-shifted patterns → a profile with error bars, or a refusal.

Each set is taken from one place: the patterns that `patterns.phase_steps` gives for a guess, seen
by a camera before the panel's middle at a known distance, or off it by a known offset. The light
of a block through a step's pattern is I = B + A·cos 2π(k·δ + k/2 − step/steps), δ the beat of
`beat`; three steps or more give A and δ by least squares. From the plane of δ follow lens count,
drift and centre, from the differences of the colours the subpixels' places, and from the contrast
of k cycles a lens against that of one the crosstalk, as a Gaussian of σ lenses passes
exp(−2π²k²σ²). Two distances part gap from pitch: 1/P = (1 + t/(n·Z))/P_sheet.

Assumed: one camera that stands still within a set, exposure and white balance locked, a response
near sRGB, the panel's own near sRGB too. What a camera's lens distorts moves fringes only as far as
there are fringes: fit again from patterns of the profile found, and it is gone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfd_render.display.calibration.beat import Beat, fit_beat
from lfd_render.display.calibration.blocks import MARGIN, Blocks, panel_from_photo
from lfd_render.display.calibration.corners import Corners, find_corners
from lfd_render.display.model import Cells, Provenance, Response, Stripes, Uncertainty
from lfd_render.display.patterns import COLOURS, Step
from lfd_render.display.profile import DisplayProfile
from lfd_render.display.rig import slot_from_eye
from lfd_render.errors import PictureError, UsageError

Float64 = NDArray[np.float64]
Pixels = NDArray[np.uint8]
Reader = Callable[[], Pixels]

LEAST_MODULATION = 0.03  # swing over mean light
LEAST_COHERENCE = 0.6
MOST_RIVAL = 0.7
MOST_RESIDUAL = 0.12  # cycles; phases of noise alone have 0.29
STRIPE_DOUBT_PX = 0.01  # subpixels this near to plain stripes are plain stripes
_LONGER_SIDE = (12, 48)  # blocks
_LENSES_A_BLOCK = 3
_SIGMA_FLOOR = 0.005  # of σ: the camera's own blur dims finer fringes, too
_SHARED_FLOOR = 1e-4  # cycles: codes of 8 bits and curves that are not quite sRGB


@dataclass(frozen=True, eq=False)
class PhotoSet:
    """Photographs from one place. `shots` are (step, file name, reader of the pixels)."""

    name: str
    shots: Sequence[tuple[Step, str, Reader]]
    white: tuple[str, Reader] | None = None
    corners: Corners | None = None
    distance_mm: float | None = None  # the guess's viewing distance if None
    offset_mm: tuple[float, float] = (0.0, 0.0)  # of the camera from before the panel's middle


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


@dataclass(frozen=True, eq=False)
class _Measured:
    """One set's plane and amplitudes; `covariance` of (a, b, middle of each colour)."""

    colours: tuple[int, ...]
    beat: Beat
    covariance: Float64
    sigma: dict[int, tuple[float, float]]  # colour → lenses and their standard uncertainty
    modulation: float
    blocks: Blocks
    corners: Corners
    distance_mm: float
    offset_mm: tuple[float, float]

    def middle(self, guess: DisplayProfile) -> Float64:
        """d of each colour in the panel's middle, at pixel centres; subpixels lie beside them."""
        places = np.array(_offsets(guess.panel.subpixels))
        aside = (places - places.mean())[list(self.colours)]
        found: Float64 = self.beat.middle + self.beat.slopes[0] * aside / guess.resolution_px[0]
        return found

    def seen(self, guess: DisplayProfile) -> Lattice:
        """The lattice as this camera sees it."""
        a, b = self.beat.slopes
        count = guess.lens_count - a
        rise = guess.lens_count * guess.drift - b
        return Lattice(count, rise / count)


@dataclass(frozen=True)
class Lattice:
    """P and T."""

    lens_count: float
    drift: float


def fit(sets: Sequence[PhotoSet], guess: DisplayProfile, name: str | None = None) -> Fit:
    """The profile that the photographs show, `guess` being that which the patterns were made for.

    One set, or two from different distances. Raises PictureError where they do not determine the
    lenses, UsageError where sets contradict each other.
    """
    if not 1 <= len(sets) <= 2:
        raise UsageError(f"fit: {len(sets)} sets of photographs; give one, or two from 2 distances")
    measured = [_measure(one, guess) for one in sets]
    here = min(measured, key=lambda m: abs(m.distance_mm - guess.distance_mm))
    gap, gap_doubt = guess.lens.gap_mm, None
    if len(measured) == 2:
        gap, gap_doubt = _gap(measured, guess, sets)
    return _assemble(here, guess, gap, gap_doubt, name, sum(len(s.shots) for s in sets))


def _measure(photos: PhotoSet, guess: DisplayProfile) -> _Measured:
    distance = guess.distance_mm if photos.distance_mm is None else photos.distance_mm
    if not 0 < distance < math.inf or not all(math.isfinite(value) for value in photos.offset_mm):
        raise UsageError(
            f"{photos.name}: camera at {photos.offset_mm} mm, {distance} mm away; give finite "
            "millimetres, the distance above 0"
        )
    groups = _groups(photos)
    corners = photos.corners
    if corners is None:
        if photos.white is None:
            raise PictureError(
                f"{photos.name}: no photograph 'white' to find the panel in; add one, or give "
                "corners"
            )
        corners = find_corners(photos.white[1](), photos.white[0])
    corners = corners.lit_by(guess.lens_count, guess.lens_count * guess.drift)
    grid = _grid(guess)
    blocks: Blocks | None = None
    sums: dict[tuple[int, int], NDArray[np.complex128]] = {}
    levels: dict[tuple[int, int], Float64] = {}
    for key, shots in groups.items():
        lights = []
        for _, file, read in shots:
            pixels = read()
            if blocks is None:
                blocks = Blocks.of(corners, pixels.shape[1::-1], grid)
            lights.append(blocks.light(pixels, file))
        sums[key], levels[key] = _demodulated([s for s, _, _ in shots], np.array(lights))
    assert blocks is not None
    colours = tuple(colour for colour, harmonic in sums if harmonic == 1)
    swing = np.array([np.where(blocks.filled, sums[colour, 1], 0) for colour in colours])
    level = np.array([levels[colour, 1] for colour in colours])
    modulation = float(np.median((np.abs(swing) / np.maximum(level, 1e-9))[:, blocks.filled]))
    if not np.abs(swing).max() > 0:
        raise _undetermined(photos.name, "the photographs of its steps do not differ")
    beat = fit_beat(blocks.u, blocks.v, swing, grid)
    _check(photos.name, beat, modulation)
    doubt = _corner_covariance(beat, blocks, corners, len(colours))
    doubt[2:, 2:] += _SHARED_FLOOR**2 * np.eye(len(colours))
    return _Measured(
        colours, beat, beat.covariance + doubt, _crosstalk(sums, swing, colours, beat, blocks),
        modulation, blocks, corners, distance, photos.offset_mm,
    )  # fmt: skip


def _groups(photos: PhotoSet) -> dict[tuple[int, int], list[tuple[Step, str, Reader]]]:
    """Shots by colour and harmonic; those of one cycle a lens come first."""
    found: dict[tuple[int, int], list[tuple[Step, str, Reader]]] = {}
    for shot in sorted(photos.shots, key=lambda s: (s[0].harmonic, s[0].colour, s[0].step)):
        found.setdefault((shot[0].colour, shot[0].harmonic), []).append(shot)
    for (colour, _), shots in found.items():
        shifts = {round(shot[0].shift, 6) for shot in shots}
        if len(shifts) < 3:
            raise _undetermined(
                photos.name,
                f"{COLOURS[colour]} has {len(shifts)} step{'s' * (len(shifts) > 1)}, as "
                f"{shots[0][1]}; three or more tell the fringes' sign and place",
            )
    if not any(harmonic == 1 for _, harmonic in found):
        raise _undetermined(
            photos.name,
            f"{len(photos.shots)} photographs have names of steps; at least three of one colour, "
            "as green_0of4.jpg, tell the fringes' sign and place",
        )
    return found


def _grid(guess: DisplayProfile) -> tuple[int, int]:
    """Blocks of about the same width and height, each of some lenses, (rows, columns)."""
    width, height = guess.size_mm
    lenses = guess.lens_count * max(1.0, height / width)
    longer = int(np.clip(lenses / _LENSES_A_BLOCK, *_LONGER_SIDE))
    scale = longer / max(width, height)
    return max(8, round(height * scale)), max(8, round(width * scale))


def _demodulated(steps: list[Step], lights: Float64) -> tuple[NDArray[np.complex128], Float64]:
    """A·exp(2πi·k·δ) and B of each block from its light in each step, [step, block]."""
    turn = 2 * np.pi * np.array([step.shift for step in steps])
    design = np.stack([np.ones_like(turn), np.cos(turn), np.sin(turn)], axis=1)
    level, cosine, sine = np.linalg.lstsq(design, lights, rcond=None)[0]
    return (cosine + 1j * sine) * (-1) ** steps[0].harmonic, level


def _check(name: str, beat: Beat, modulation: float) -> None:
    """Raise PictureError for phases that are no plane of fringes."""
    rms = float(np.sqrt(np.nanmean(beat.residual**2)))
    if modulation < LEAST_MODULATION:
        raise _undetermined(
            name,
            f"the light swings by {100 * modulation:.1f} % between steps, it should by "
            f"{100 * LEAST_MODULATION:.0f} % at least",
        )
    if beat.coherence < LEAST_COHERENCE or rms > MOST_RESIDUAL:
        raise _undetermined(
            name,
            f"its fringes are no straight and even ones (coherence {beat.coherence:.2f}, should be "
            f"{LEAST_COHERENCE:g}; {rms:.2f} fringes rms, should be {MOST_RESIDUAL:g}): wrong "
            "corners, another panel, or a guess too far off",
        )
    if beat.rival > MOST_RIVAL:
        raise _undetermined(
            name,
            f"two sets of fringes are alike (the second {beat.rival:.2f} of the first, should be "
            f"below {MOST_RIVAL:g})",
        )


def _undetermined(name: str, why: str) -> PictureError:
    return PictureError(
        f"{name}: the photographs do not determine the lenses: {why}; photograph the patterns of "
        "'display pattern phases' from before the panel, in a dark room, with exposure locked"
    )


def _corner_covariance(beat: Beat, blocks: Blocks, corners: Corners, groups: int) -> Float64:
    """What the corners' uncertainty makes of the parameters'."""
    forward = corners.photo_from_panel()
    point = forward @ np.stack([blocks.u, 1 - blocks.v, np.ones_like(blocks.u)])
    x, y = point[:2] / point[2]
    a, b = beat.slopes
    total = np.zeros((2 + groups, 2 + groups))
    for corner in range(4):
        for axis in range(2):
            moved = corners.xy_px.copy()
            moved[corner, axis] += 0.5
            u, v_top = panel_from_photo(replace(corners, xy_px=moved).photo_from_panel(), x, y)
            phase = a * (u - blocks.u) + b * (1 - v_top - blocks.v)
            change = beat.project @ np.tile(phase, groups) / 0.5 * corners.doubt_px
            total += np.outer(change, change)
    return total


def _crosstalk(
    sums: dict[tuple[int, int], NDArray[np.complex128]],
    swing: NDArray[np.complex128],
    colours: tuple[int, ...],
    beat: Beat,
    blocks: Blocks,
) -> dict[int, tuple[float, float]]:
    """σ of each colour's response in lenses, from contrasts: A_1/A_k = exp(2π²(k² − 1)σ²)."""
    found = {}
    a, b = beat.slopes
    rows, columns = blocks.grid
    part = np.arange(rows)[:, None] * 4 // rows * 4 + np.arange(columns) * 4 // columns
    for (colour, harmonic), many in sums.items():
        if harmonic == 1 or colour not in colours:
            continue
        group = colours.index(colour)
        plane = a * blocks.u + b * blocks.v + beat.offsets[group]
        one = (swing[group] * np.exp(-2j * np.pi * plane)).real
        more = (np.where(blocks.filled, many, 0) * np.exp(-2j * np.pi * harmonic * plane)).real
        # A block takes the mean of the fringes that cross it, which dims finer ones more.
        across, up = (1 - 2 * MARGIN) / columns * a, (1 - 2 * MARGIN) / rows * b
        more *= np.sinc(across) * np.sinc(up) / np.sinc(harmonic * across) / np.sinc(harmonic * up)
        whole = more.sum() / one.sum()
        parts = np.bincount(part.ravel(), more) / np.bincount(part.ravel(), one)
        doubt = float(parts.std(ddof=1)) / 4
        squared = -math.log(max(whole, 1e-6)) / (2 * np.pi**2 * (harmonic**2 - 1))
        spread = doubt / max(whole, 1e-6) / (2 * np.pi**2 * (harmonic**2 - 1))
        sigma = math.sqrt(max(squared, 0.0))
        # σ² is what is measured; near 0 its root is less certain than it is large.
        doubt = math.sqrt(max(squared, 0.0) + spread) - sigma
        found[colour] = sigma, math.hypot(doubt, _SIGMA_FLOOR * sigma)
    return found


def _gap(
    measured: Sequence[_Measured], guess: DisplayProfile, sets: Sequence[PhotoSet]
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
    here: _Measured,
    guess: DisplayProfile,
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
    subpixels, offset_px, doubts_px = _subpixels(here, guess, count)
    weights, values, measured = [], [], here.middle(guess)
    for group, colour in enumerate(here.colours):
        moved = (_offsets(guess.panel.subpixels)[colour] * guess.lens_count
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
    doubts |= {f"offset_px.{COLOURS[c]}": value for c, value in doubts_px.items()}

    assumed = _still_assumed(guess, gap_doubt is not None)
    known = {key: value for key, value in doubts.items() if key in Uncertainty.model_fields}
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
    views = guess.views
    with np.errstate(invalid="ignore"):
        counted = np.isfinite(here.beat.residual)
        total = np.where(counted, here.beat.residual, 0).sum(axis=0)
        residual = -views * np.where(counted.any(axis=0), total / counted.sum(axis=0).clip(1),
                                     np.nan).reshape(here.blocks.grid)  # fmt: skip
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


def _doubts(
    here: _Measured, count: float, drift: float, share: Float64, stretched: float
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


def _offsets(subpixels: Stripes | Cells) -> tuple[float, float, float]:
    """Offsets of the colours to the right, in pixels: the mean of all cells."""
    if isinstance(subpixels, Stripes):
        return subpixels.offsets_px()
    red, green, blue = np.array(subpixels.offsets_px)[..., 0].mean(axis=0)
    return float(red), float(green), float(blue)


def _subpixels(
    here: _Measured, guess: DisplayProfile, count: float
) -> tuple[Stripes | Cells, list[float], dict[int, float]]:
    """Layout that the colours show, offsets in pixels from the origin, and their uncertainties.

    d_c = center − center_g + (off_g·P_g − off·P)/W for each colour c.
    """
    known = list(_offsets(guess.panel.subpixels))
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
        places = _offsets(layout)
        misses = [
            abs(_nearest(found[c] - found[first] - places[c] + places[first], width / count))
            <= max(STRIPE_DOUBT_PX, 3 * doubts[c])
            for c in here.colours[1:]
        ]
        if all(misses):
            return layout, list(places), doubts
    return _cells(found), found, doubts


def _nearest(offset: float, period: float) -> float:
    return offset - period * round(offset / period)


def _cells(found: list[float]) -> Cells:
    red, green, blue = ((offset, 0.0) for offset in found)
    return Cells(layout="cells", pattern_mode=0, offsets_px=((red, green, blue),))


def _still_assumed(guess: DisplayProfile, with_gap: bool) -> tuple[str, ...]:
    measured: tuple[str, ...] = ("lens.lens_count", "lens.drift", "lens.tilt", "lens.center")
    measured += ("lens.gap_mm",) if with_gap else ()
    return tuple(a for a in guess.provenance.assumed if not a.startswith(measured))


def _triple(values: list[float]) -> tuple[float, float, float]:
    red, green, blue = values
    return red, green, blue

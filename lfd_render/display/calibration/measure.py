"""One set of photographs → the plane of its fringes, and the amplitudes of its patterns.

The light of a block through a step's pattern is I = B + A·cos 2π(k·δ + k/2 − step/steps), δ as in
`beat`; three steps or more give A and δ by least squares. As a Gaussian of σ lenses passes
exp(−2π²k²σ²) of k cycles a lens, their contrast against that of one cycle tells the crosstalk.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lfd_render.display.calibration.beat import Beat, Complex, fit_beat
from lfd_render.display.calibration.blocks import MARGIN, Blocks, panel_from_photo
from lfd_render.display.calibration.corners import Corners, Float64, Pixels, find_corners
from lfd_render.display.model import Cells, Stripes
from lfd_render.display.patterns import COLOURS, Step
from lfd_render.display.profile import DisplayProfile
from lfd_render.errors import PictureError, UsageError

Reader = Callable[[], Pixels]

LEAST_MODULATION = 0.03  # swing over mean light
LEAST_COHERENCE = 0.6
MOST_RIVAL = 0.7
MOST_RESIDUAL = 0.12  # cycles; phases of noise alone have 0.29
_ALIKE_FRINGES = 0.5
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


@dataclass(frozen=True)
class Lattice:
    """P and T."""

    lens_count: float
    drift: float


@dataclass(frozen=True, eq=False)
class Measured:
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
        places = np.array(offsets_px(guess.panel.subpixels, guess))
        aside = (places - places.mean())[list(self.colours)]
        found: Float64 = self.beat.middle + self.beat.slopes[0] * aside / guess.resolution_px[0]
        return found

    def seen(self, guess: DisplayProfile) -> Lattice:
        """The lattice as this camera sees it."""
        a, b = self.beat.slopes
        count = guess.lens_count - a
        rise = guess.lens_count * guess.drift - b
        return Lattice(count, rise / count)


def measure(photos: PhotoSet, guess: DisplayProfile) -> Measured:
    """What a set shows. Raises PictureError where that does not determine the lenses."""
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
    finer_lights: list[Float64] = []
    sums: dict[tuple[int, int], Complex] = {}
    levels: dict[tuple[int, int], Float64] = {}
    for key, shots in groups.items():
        lights = []
        for _, file, read in shots:
            pixels = read()
            if blocks is None:
                blocks = Blocks.of(corners, pixels.shape[1::-1], grid)
                finer = Blocks.of(corners, pixels.shape[1::-1], _finer(grid))
            lights.append(blocks.light(pixels, file))
            if not sums:
                finer_lights.append(finer.light(pixels, file))
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
    first = [step for step, _, _ in next(iter(groups.values()))]
    finer_swing = np.where(finer.filled, _demodulated(first, np.array(finer_lights))[0], 0)
    again = fit_beat(finer.u, finer.v, finer_swing[None], finer.grid)
    _check_alike(photos.name, beat, again)
    doubt = _corner_covariance(beat, blocks, corners, len(colours))
    doubt[2:, 2:] += _SHARED_FLOOR**2 * np.eye(len(colours))
    return Measured(
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


def _demodulated(steps: list[Step], lights: Float64) -> tuple[Complex, Float64]:
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


def _finer(grid: tuple[int, int]) -> tuple[int, int]:
    """Blocks of another size, in which fringes finer than two blocks would seem others."""
    rows, columns = grid
    return rows * 4 // 3 + 1, columns * 4 // 3 + 1


def _check_alike(name: str, beat: Beat, again: Beat) -> None:
    """Raise PictureError for fringes that depend on the blocks in which they are sought."""
    apart = max(abs(p - q) for p, q in zip(beat.slopes, again.slopes, strict=True))
    if apart > _ALIKE_FRINGES:
        raise _undetermined(
            name,
            f"its fringes are too fine to follow, {abs(beat.slopes[0]):.1f} or "
            f"{abs(again.slopes[0]):.1f} across: the guess is too far off, come nearer by eye",
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
    sums: dict[tuple[int, int], Complex],
    swing: Complex,
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


def offsets_px(subpixels: Stripes | Cells, profile: DisplayProfile) -> tuple[float, float, float]:
    """Offsets of the colours in pixels to the right, the mean of all cells.

    One upwards counts as that to the right which has the same phase: T·W/H of it.
    """
    if isinstance(subpixels, Stripes):
        upright = subpixels.axis == "up"
        offsets = [((0.0, o) if upright else (o, 0.0)) for o in subpixels.offsets_px()]
    else:
        offsets = list(np.array(subpixels.offsets_px).mean(axis=0))
    width, height = profile.resolution_px
    red, green, blue = (float(x + y * profile.drift * width / height) for x, y in offsets)
    return red, green, blue

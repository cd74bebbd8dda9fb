"""Test patterns: pictures of a panel, uint8 [y, x, 3], exact under the profile they are made for.

A grating lights the subpixels of one view; an eye in that view's place sees it everywhere if the
profile is right, and fringes that follow the difference of the lattices if it is not. The patterns
of a phase-shifted set are smooth: k cycles a lens, light ½ + 0.4·cos 2π(kφ − step/steps), encoded
as sRGB, so that a camera measures the fringes' phase (`calibration`). Rulers show many wrong
profiles at once, one a band, with the number that each stands for.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from lfd_render.display.profile import DisplayProfile
from lfd_render.errors import UsageError

Pixels = NDArray[np.uint8]

COLOURS = ("red", "green", "blue")
MEAN_LIGHT, AMPLITUDE = 0.5, 0.4  # neither black nor white, which a camera may clip
STEPS = 4
MAX_STEPS = 32
RULER_BANDS = 9
BAR_WIDTHS = (1, 2, 3, 4, 6, 8, 12, 16)
_BLOCK_ROWS = 64
_SHOT = re.compile(r"(red|green|blue)(?:_h(\d{1,2}))?_(\d{1,2})of(\d{1,2})")


@dataclass(frozen=True)
class Step:
    """One pattern of a phase-shifted set: `harmonic` cycles a lens, shifted by step/steps."""

    colour: int
    harmonic: int
    step: int
    steps: int

    @property
    def name(self) -> str:
        """Name of its file, without suffix, as `green_0of4` or `green_h3_0of4`."""
        harmonic = "" if self.harmonic == 1 else f"_h{self.harmonic}"
        return f"{COLOURS[self.colour]}{harmonic}_{self.step}of{self.steps}"

    @property
    def shift(self) -> float:
        """Shift in cycles."""
        return self.step / self.steps

    @staticmethod
    def named(name: str) -> Step | None:
        """The step of a name; None for any other name."""
        found = _SHOT.fullmatch(name)
        if not found:
            return None
        colour, harmonic, step, steps = found.groups()
        made = Step(COLOURS.index(colour), int(harmonic or 1), int(step), int(steps))
        sound = made.harmonic >= 1 and 3 <= made.steps <= MAX_STEPS and made.step < made.steps
        return made if sound else None


def crosstalk_harmonic(profile: DisplayProfile) -> int:
    """Cycles a lens whose contrast tells the crosstalk: three, or fewer where pixels are coarse."""
    pixels = profile.resolution_px[0] / profile.lens_count
    return max(1, min(3, int((pixels - 0.5) / 2)))


def phase_steps(
    profile: DisplayProfile, steps: int = STEPS, colours: tuple[int, ...] = (0, 1, 2)
) -> list[Step]:
    """The steps of a set: one cycle a lens, then several for the crosstalk. Raises UsageError."""
    if not 3 <= steps <= MAX_STEPS:
        raise UsageError(f"steps: {steps} is out of range; use 3 to {MAX_STEPS}")
    harmonics = sorted({1, crosstalk_harmonic(profile)})
    return [
        Step(colour, harmonic, step, steps)
        for harmonic in harmonics
        for colour in colours
        for step in range(steps)
    ]


def phase_pattern(profile: DisplayProfile, step: Step) -> Pixels:
    """Smooth grating of one colour, shifted by a step."""
    tables = profile.phase_tables()
    picture = blank(profile, 0)
    for rows in _blocks(profile):
        phase = tables.phase(rows)[..., step.colour]
        cycles = step.harmonic * (phase - np.floor(phase)) - step.shift
        light = MEAN_LIGHT + AMPLITUDE * np.cos(2 * np.pi * cycles)
        picture[rows, :, step.colour] = _codes(light)
    return picture


def blank(profile: DisplayProfile, code: int) -> Pixels:
    """The panel in one grey."""
    width, height = profile.resolution_px
    return np.full((height, width, 3), code, np.uint8)


def view_grating(
    profile: DisplayProfile,
    view: int | None = None,
    width_views: int = 1,
    colours: tuple[int, ...] = (0, 1, 2),
) -> Pixels:
    """The subpixels of `width_views` views about `view`, the middle one by default, lit.

    Raises UsageError for views that the display has not.
    """
    views = profile.views
    middle = views // 2 if view is None else view
    if not 0 <= middle < views:
        raise UsageError(f"view: {view} is out of range; '{profile.name}' has 0 to {views - 1}")
    if not 1 <= width_views <= views:
        raise UsageError(f"width: {width_views} views is out of range; use 1 to {views}")
    lit = _within(profile.view_index_map(), middle, width_views, views)
    for channel in set(range(3)) - set(colours):
        lit[..., channel] = False
    return np.where(lit, np.uint8(255), np.uint8(0))


def ruler_width(profile: DisplayProfile) -> int:
    """Views to light for a person: enough to see, few enough to judge."""
    return max(1, profile.views // 6)


def view_numbers(profile: DisplayProfile) -> Pixels:
    """Each view shows its own number, as many times as fit; leading zeros included."""
    width, height = profile.resolution_px
    digits = len(str(profile.views - 1))
    glyph_height = max(12, min(height // 4, 2 * width // (3 * (digits + 1))))
    glyphs = _digits(glyph_height)
    _, glyph_height, glyph_width = glyphs.shape
    cell_width, cell_height = (digits + 1) * glyph_width, glyph_height * 3 // 2
    x = np.arange(width) % cell_width
    place, column = np.minimum(x // glyph_width, digits), x % glyph_width
    power = 10 ** np.maximum(digits - 1 - place, 0)
    index = profile.view_index_map()
    picture = blank(profile, 0)
    for y in range(height):
        row = y % cell_height
        if row < glyph_height:
            digit = index[y].astype(np.int64) // power[:, None] % 10
            lit = glyphs[digit, row, column[:, None]]
            picture[y] = np.where(place[:, None] < digits, lit, 0)
    return picture


def pitch_ruler(profile: DisplayProfile, step_lenses: float = 0.25) -> Pixels:
    """Bands of gratings with other lens counts, the profile's in the middle, larger ones above.

    The band without fringes across has the right count. All agree at the panel's middle column.
    """
    counts = [profile.lens_count + step_lenses * (RULER_BANDS // 2 - b) for b in range(RULER_BANDS)]
    width, height = profile.resolution_px
    edges = np.linspace(0, height, RULER_BANDS + 1).astype(int)
    picture = blank(profile, 0)
    for band, count in enumerate(counts):
        drift = profile.drift * profile.lens_count / count
        rows = slice(edges[band], edges[band + 1])
        turned = _turned(profile, count, drift)
        picture[rows] = view_grating(turned, None, ruler_width(profile))[rows]
    labels = [f"{count:.2f}" for count in counts]
    places = [(0, int(edges[b])) for b in range(RULER_BANDS)]
    return _labelled(picture, labels, places, min(height // (2 * RULER_BANDS), width // 24))


def tilt_ruler(profile: DisplayProfile, step_deg: float = 0.05) -> Pixels:
    """Columns of gratings with other tilts, the profile's in the middle, larger ones to the right.

    The column lit alike from top to bottom has the right tilt. All agree at the middle row.
    """
    width = profile.resolution_px[0]
    tilt_deg = np.degrees(profile.tilt_rad)
    tilts = [tilt_deg + step_deg * (band - RULER_BANDS // 2) for band in range(RULER_BANDS)]
    edges = np.linspace(0, width, RULER_BANDS + 1).astype(int)
    aspect = profile.size_mm[1] / profile.size_mm[0]
    picture = blank(profile, 0)
    for band, tilt in enumerate(tilts):
        drift = aspect * float(np.tan(np.radians(tilt)))
        columns = slice(edges[band], edges[band + 1])
        turned = _turned(profile, profile.lens_count, drift)
        picture[:, columns] = view_grating(turned, None, ruler_width(profile))[:, columns]
    labels = [f"{tilt:.2f}" for tilt in tilts]
    places = [(int(edges[b]), 0) for b in range(RULER_BANDS)]
    return _labelled(picture, labels, places, max(8, width // (4 * RULER_BANDS)))


def crosstalk_bars(profile: DisplayProfile) -> Pixels:
    """Bars of 1, 2, 3, 4, 6, 8, 12 and 16 views about the middle, lit on the left half, dark on
    the right.

    The eye in the middle sees full light to the left, and black to the right, from that width on
    which the lenses' crosstalk does not reach beyond.
    """
    width, height = profile.resolution_px
    widths = [w for w in BAR_WIDTHS if w <= max(1, profile.views // 2)]
    edges = np.linspace(0, height, len(widths) + 1).astype(int)
    index = profile.view_index_map()
    picture = blank(profile, 0)
    for bar, wide in enumerate(widths):
        rows = slice(edges[bar], edges[bar + 1])
        lit = _within(index[rows], profile.views // 2, wide, profile.views)
        lit[:, width // 2 :] = ~lit[:, width // 2 :]
        picture[rows] = np.where(lit, np.uint8(255), np.uint8(0))
    places = [(0, int(edge)) for edge in edges[:-1]]
    size = min(height // (2 * len(widths)), width // 24)
    return _labelled(picture, [str(w) for w in widths], places, size)


PATTERNS: dict[str, Callable[[DisplayProfile], Pixels]] = {
    "grating": view_grating,
    "numbers": view_numbers,
    "pitch-ruler": pitch_ruler,
    "tilt-ruler": tilt_ruler,
    "crosstalk": crosstalk_bars,
    "white": lambda profile: blank(profile, 255),
}


def _within(
    index: NDArray[np.uint16], middle: int, width_views: int, views: int
) -> NDArray[np.bool_]:
    """Where the view is one of `width_views` about `middle`, the cone taken round."""
    past: NDArray[np.int64] = (index.astype(np.int64) - middle + width_views // 2) % views
    return past < width_views


def _turned(profile: DisplayProfile, lens_count: float, drift: float) -> DisplayProfile:
    """The profile with another lattice, of the same phase at the panel's middle."""
    lens = profile.lens
    was = lens.lens_count * (1 + lens.drift) / 2 - lens.center
    center = lens_count * (1 + drift) / 2 - was
    changed = {"lens_count": lens_count, "drift": drift, "center": center}
    return profile.model_copy(update={"lens": lens.model_copy(update=changed)})


def _codes(light: NDArray[np.float64]) -> Pixels:
    """sRGB codes of light (IEC 61966-2-1)."""
    encoded = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    codes: Pixels = np.rint(255 * encoded).astype(np.uint8)
    return codes


def _blocks(profile: DisplayProfile) -> Iterator[slice]:
    height = profile.resolution_px[1]
    return (slice(y, min(y + _BLOCK_ROWS, height)) for y in range(0, height, _BLOCK_ROWS))


def _digits(height: int) -> Pixels:
    """Pictures of the ten digits, [digit, y, x], white on black."""
    font = ImageFont.load_default(height)
    width = max(8, round(0.7 * height))
    glyphs = np.empty((10, height, width), np.uint8)
    for digit in range(10):
        image = Image.new("L", (width, height))
        ImageDraw.Draw(image).text(
            (width / 2, height / 2), str(digit), fill=255, font=font, anchor="mm"
        )
        glyphs[digit] = np.where(np.asarray(image) > 127, 255, 0)
    return glyphs


def _labelled(
    picture: Pixels, labels: list[str], places: list[tuple[int, int]], size_px: int
) -> Pixels:
    """Labels, black on white and so the same in all views, at their top left corners."""
    image = Image.fromarray(picture)
    draw = ImageDraw.Draw(image)
    font = ImageFont.load_default(max(8, size_px))
    for label, (x, y) in zip(labels, places, strict=True):
        box = draw.textbbox((x + 3, y + 3), label, font=font)
        draw.rectangle((box[0] - 3, box[1] - 3, box[2] + 3, box[3] + 3), fill=(255, 255, 255))
        draw.text((x + 3, y + 3), label, fill=(0, 0, 0), font=font)
    return np.array(image)

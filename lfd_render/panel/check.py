"""What a wrong profile costs: by how many views each subpixel of a display driven by it is off.

A subpixel at phase φ under its lens is seen by the eye at z = 1 − frac φ. Woven for phase φ' it
holds the view of z' instead, N·(z' − z) views from its own, the shorter way round the cone. (Where
views are inverted z is frac φ.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from lfd_render.display import DisplayProfile
from lfd_render.errors import ProfileError

Float64 = NDArray[np.float64]

PICTURE_PX = 960  # longer side of the picture, at most
_BAR_PX = 28
_BLUE, _WHITE, _RED = np.array([33, 102, 172]), np.array([247, 247, 247]), np.array([178, 24, 43])
_LINE = 0.45  # a line each whole view darkens to this
_MOST_LINES = 12  # beyond so many views lines would cover the picture
_BLOCK_ROWS = 64
CORNERS = ("top_left", "top_right", "bottom_left", "bottom_right")


@dataclass(frozen=True, eq=False)
class ViewErrors:
    """Errors in views; positive: the eye sees a view from farther right than it should.

    error: of the green subpixels on a grid of panel pixels, [y, x]. The rest over all subpixels.
    """

    error: Float64
    mean: float
    rms: float
    largest: float  # of magnitudes
    beyond_half: float  # share of subpixels that are more than half a view off
    corners: dict[str, float]
    centre: float
    fringes: tuple[float, float]  # whole turns through the cone across and up the panel

    def to_json_dict(self) -> dict[str, object]:
        """The numbers, as `--json` prints them."""
        return {
            "mean_views": round(self.mean, 6),
            "rms_views": round(self.rms, 6),
            "max_views": round(self.largest, 6),
            "beyond_half_a_view": round(self.beyond_half, 6),
            "corner_views": {name: round(value, 6) for name, value in self.corners.items()},
            "centre_views": round(self.centre, 6),
            "fringes": [round(count, 6) for count in self.fringes],
        }

    def picture(self) -> NDArray[np.uint8]:
        """The panel, uint8 [y, x, 3]: blue where views from the left show, red where from the
        right, a line at each whole view, and the scale below."""
        span = max(0.5, float(np.ceil(2 * self.largest) / 2))
        panel = _coloured(self.error, span)
        height, width = self.error.shape
        bar = np.linspace(-span, span, width)[None].repeat(_BAR_PX, axis=0)
        image = Image.fromarray(np.concatenate([panel, _coloured(bar, span)]))
        draw = ImageDraw.Draw(image)
        middle = height + _BAR_PX / 2
        for x, anchor, value in ((4, "lm", -span), (width / 2, "mm", 0.0), (width - 4, "rm", span)):
            ink = (20, 20, 20) if value == 0 else (255, 255, 255)
            label = "0 views" if value == 0 else f"{value:+g}"
            draw.text((x, middle), label, fill=ink, anchor=anchor)
        return np.asarray(image)


def view_errors(profile: DisplayProfile, other: DisplayProfile, views: int) -> ViewErrors:
    """By how many of N views a picture woven for `other` is off on the display of `profile`.

    Raises ProfileError where the panels differ in pixels.
    """
    if profile.resolution_px != other.resolution_px:
        raise ProfileError(
            f"display '{other.name}': its panel has {_px(other)} pixels, that of '{profile.name}' "
            f"{_px(profile)}; compare profiles of one panel"
        )
    width, height = profile.resolution_px
    true, wrong = profile.phase_tables(), other.phase_tables()
    sign, other_sign = (-1 if tables.inverted else 1 for tables in (true, wrong))
    step = max(1, -(-max(width, height) // PICTURE_PX))
    total = squares = largest = 0.0
    beyond = 0
    picture_rows = []
    for start in range(0, height, _BLOCK_ROWS):
        part = slice(start, min(start + _BLOCK_ROWS, height))
        error = _wrapped(sign * true.phase(part) - other_sign * wrong.phase(part)) * views
        total += float(error.sum())
        squares += float(np.square(error).sum())
        largest = max(largest, float(np.abs(error).max()))
        beyond += int(np.count_nonzero(np.abs(error) > 0.5))
        picture_rows.append(error[-start % step :: step, ::step, 1])
    count = 3 * width * height

    def at(x: int, y: int) -> float:
        where = np.array([[x]]), np.array([[y]])
        here = where[0][..., None], where[1][..., None]
        difference = sign * true.phase_at(*here) - other_sign * wrong.phase_at(*here)
        return float(_wrapped(difference)[0, 0, 1]) * views

    ends = [(0, 0), (width - 1, 0), (0, height - 1), (width - 1, height - 1)]
    return ViewErrors(
        np.concatenate(picture_rows),
        total / count,
        float(np.sqrt(squares / count)),
        largest,
        beyond / count,
        {name: at(*end) for name, end in zip(CORNERS, ends, strict=True)},
        at(width // 2, height // 2),
        (
            sign * profile.lens_count - other_sign * other.lens_count,
            sign * profile.lens_count * profile.drift - other_sign * other.lens_count * other.drift,
        ),
    )


def _wrapped(turns: Float64) -> Float64:
    """Differences of phase in lenses, from −½ to ½."""
    return turns - np.rint(turns)


def _coloured(error: Float64, span: float) -> NDArray[np.uint8]:
    """Errors [y, x] in colours: white at 0, blue at −span, red at span."""
    amount = np.clip(np.abs(error) / span, 0, 1)[..., None]
    end = np.where(error[..., None] < 0, _BLUE, _RED)
    colour = _WHITE + (end - _WHITE) * amount
    if span <= _MOST_LINES:
        whole = np.rint(error)
        crossed = np.zeros(error.shape, np.bool_)
        side = error > whole
        crossed[:, 1:] |= (whole[:, 1:] == whole[:, :-1]) & (side[:, 1:] != side[:, :-1])
        crossed[1:] |= (whole[1:] == whole[:-1]) & (side[1:] != side[:-1])
        colour = np.where((crossed & (whole != 0))[..., None], colour * _LINE, colour)
    codes: NDArray[np.uint8] = np.rint(colour).astype(np.uint8)
    return codes


def _px(profile: DisplayProfile) -> str:
    return " x ".join(map(str, profile.resolution_px))

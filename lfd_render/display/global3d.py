"""The INI of 3D Global monitors: whole views a subpixel, a row's shift as a fraction.

    view = (⌊3·x + dir·((y·num/den) mod n) + n⌋ + offset + c) mod n

x and y are whole numbers from the left and the top, c the stripe. Views are counted from the right,
as van Berkel's are: the formula is his with X = n, tan α = −dir·num/(3·den) and k_off = offset − ½.
Phases on a view's boundary, which every den-th row has, belong to the view that the floor gives;
half a step, 1/(2·den) of a subpixel, keeps the profile's phases off them.

The vendor's file says nothing of the panel, so a section [panel] of ours goes with it.
"""

from __future__ import annotations

import configparser
import io
import math
import re
from decimal import Decimal
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from lfd_render.display.exact import exactly
from lfd_render.display.forms import FORMS, Setting
from lfd_render.display.model import ASSUMED_INDEX, SCHEMA, Stripes
from lfd_render.errors import ProfileError

if TYPE_CHECKING:
    from lfd_render.display.profile import DisplayProfile

_MOST_DENOMINATOR = 64
_INTERLACING = {
    "views": (1, 64), "angle_numerator": (0, 4096), "angle_denominator": (1, 4096),
    "direction": (-1, 1), "bgr": (0, 1), "offset": (-4096, 4096),
}  # fmt: skip
_PANEL = ("width_px", "height_px", "width_mm", "height_mm", "distance_mm", "cone_deg")


def is_ini(text: str) -> bool:
    """Whether a text begins like such a file."""
    return re.match(r"\s*(?:[;#][^\n]*\n\s*)*\[(interlacing|panel)\]", text) is not None


def ini_data(text: str, source: str) -> dict[str, Any]:
    """Data of a profile file that says the same. Raises ProfileError naming section and field."""
    parser = configparser.ConfigParser(interpolation=None)
    try:
        parser.read_string(text)
    except (configparser.Error, ValueError) as cause:
        reason = " ".join(str(cause).split())
        raise ProfileError(f"{source}: is not a valid INI: {reason:.150}; correct it") from cause
    whole = {name: _whole(parser, name, *limits, source) for name, limits in _INTERLACING.items()}
    panel = {name: _above_0(parser, name, source) for name in _PANEL}
    if whole["direction"] == 0:
        raise ProfileError(f"{source}: interlacing.direction is 0; it should be 1 or -1")
    views, numerator, denominator, direction, bgr, offset = whole.values()
    width, height, width_mm, height_mm = (Decimal(panel[name]) for name in _PANEL[:4])
    setting = Setting(width, height, width_mm, height_mm, Decimal(views), Decimal(1))
    with exactly():
        lens = FORMS["van-berkel"].lens(
            {
                "subpixels_per_lens": Decimal(views),
                "tan_alpha": Decimal(-direction * numerator) / (3 * denominator),
                "k_off": offset - (Decimal(1) - Decimal(1) / denominator) / 2,
            },
            setting,
        )
        lens_data = {name: float(value) for name, value in lens.items()}
    stripes = {"layout": "stripe", "order": "bgr" if bgr else "rgb"}
    stripes["origin"] = f"{'blue' if bgr else 'red'}-at-pixel-centre"
    return {
        "schema": SCHEMA,
        "name": f"3d-global-{views}-views",
        "panel": {
            "resolution_px": [_pixels(panel, side, source) for side in _PANEL[:2]],
            "size_mm": [panel["width_mm"], panel["height_mm"]],
            "subpixels": stripes,
        },
        "lens": {**lens_data, "index": ASSUMED_INDEX},
        "viewing": {
            "views": views,
            "cone_deg": panel["cone_deg"],
            "distance_mm": panel["distance_mm"],
        },
        "provenance": {"source": "3D Global INI", "assumed": ["lens.index"]},
    }


def ini_text(profile: DisplayProfile) -> str:
    """INI that comes nearest to a profile. Raises ProfileError for other subpixels than stripes."""
    subpixels = profile.panel.subpixels
    if not isinstance(subpixels, Stripes) or subpixels.axis != "right":
        raise ProfileError(
            f"display '{profile.name}': panel.subpixels are no stripes to the right; a 3D Global "
            "INI knows no others"
        )
    width, height = profile.resolution_px
    views = min(max(1, round(3 * width / profile.lens_count)), _INTERLACING["views"][1])
    lean = Fraction(profile.drift * width / height * 3).limit_denominator(_MOST_DENOMINATOR)
    numerator = min(abs(lean.numerator), _INTERLACING["angle_numerator"][1])
    direction = -1 if lean > 0 else 1
    leftmost = min(subpixels.offsets_px())
    row_shift = -direction * numerator / lean.denominator
    offset = (
        1.5 + 3 * leftmost + (height - 0.5) * row_shift - profile.center * views
        - 0.5 / lean.denominator
    )  # fmt: skip
    writer = configparser.ConfigParser(interpolation=None)
    writer["interlacing"] = {
        "views": str(views),
        "angle_numerator": str(numerator),
        "angle_denominator": str(lean.denominator),
        "direction": str(direction),
        "bgr": str(int(subpixels.order == "bgr")),
        "offset": str(round(math.fmod(offset, views)) % views),
    }
    writer["panel"] = {
        "width_px": str(width),
        "height_px": str(height),
        "width_mm": repr(profile.size_mm[0]),
        "height_mm": repr(profile.size_mm[1]),
        "distance_mm": repr(profile.distance_mm),
        "cone_deg": repr(profile.viewing.cone_deg),
    }
    text = io.StringIO()
    writer.write(text)
    return text.getvalue()


def _text(parser: configparser.ConfigParser, section: str, name: str, source: str) -> str:
    if not parser.has_option(section, name):
        raise ProfileError(f"{source}: {section}.{name} is missing; add it")
    return parser.get(section, name).strip()


def _whole(parser: configparser.ConfigParser, name: str, low: int, high: int, source: str) -> int:
    text = _text(parser, "interlacing", name, source)
    if not re.fullmatch(r"[+-]?\d{1,6}", text) or not low <= int(text) <= high:
        raise ProfileError(
            f"{source}: interlacing.{name} is {text!r:.60}; it should be a whole number from {low} "
            f"to {high}"
        )
    return int(text)


def _above_0(parser: configparser.ConfigParser, name: str, source: str) -> float:
    text = _text(parser, "panel", name, source)
    number = r"(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?"
    if not re.fullmatch(number, text) or not 0 < float(text) < 1e9:
        raise ProfileError(f"{source}: panel.{name} is {text!r:.60}; it should be a number above 0")
    return float(text)


def _pixels(panel: dict[str, float], name: str, source: str) -> int:
    if panel[name] != int(panel[name]):
        raise ProfileError(f"{source}: panel.{name} is {panel[name]}; it should be a whole number")
    return int(panel[name])

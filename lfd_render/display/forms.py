"""Other systems' numbers for the same lens lattice, in files of the schema `lfd-display-form/1`.

    van-berkel   X subpixels a lens, tan α, k_off:
                 V = ⌊((k + ½ + k_off − 3·l·tan α) mod X)·N/X⌋, V counted from the right,
                 k = 3·x + stripe, l the row from the top; tan α in pixels, as subpixels a row
    physical     pitch of the sheet across the lens axis, tilt, gap, index, seen from distance_mm
    leia         view coordinate z = m·(x, y, c/3) + b, view = ⌊z·N + ½⌋ mod N, x and y whole
                 numbers from the left and the top

A file holds the form's `numbers`, and under `profile` all that they do not say, so that nothing is
lost. `van-berkel` and `leia` know stripes in a row alone: for others there is no such file.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from decimal import Decimal
from typing import TYPE_CHECKING, Any

from lfd_render.display.exact import PI, atan, exactly, json_text, read_exact, shortest, tan
from lfd_render.errors import ProfileError

if TYPE_CHECKING:
    from lfd_render.display.exact import Numbers
    from lfd_render.display.profile import DisplayProfile

FORM_SCHEMA = "lfd-display-form/1"
_HALF, _QUARTER_TURN_DEG = Decimal("0.5"), 90
_ROUNDED = Decimal("1e-9")  # what others may have rounded a matrix's entries to, relatively


@dataclass(frozen=True)
class Setting:
    """What a form's numbers are read against, all of it from the rest of the profile."""

    width: Decimal
    height: Decimal
    width_mm: Decimal
    height_mm: Decimal
    views: Decimal
    distance_mm: Decimal
    origin: int = 0  # which stripe from the left the phase formula puts at +0
    reversed: bool = False  # stripes are blue, green, red


@dataclass(frozen=True)
class Form:
    """One system. `lens` turns its numbers into those of a profile, `numbers` does the reverse."""

    fields: tuple[str, ...]
    lens: Callable[[Numbers, Setting], dict[str, Decimal]]
    numbers: Callable[[Numbers, Setting], dict[str, Decimal]]


def is_form(data: object) -> bool:
    """Whether parsed JSON is a file of another system's numbers."""
    return isinstance(data, dict) and data.get("schema") == FORM_SCHEMA


def form_text(profile: DisplayProfile, name: str) -> str:
    """File of a profile in the numbers of a form. Raises ProfileError where it has none."""
    form = FORMS[name]
    rest = json.loads(profile.to_json())
    lens = {
        key: Decimal(value) for key, value in rest["lens"].items() if isinstance(value, float | int)
    }
    if name == "physical" and "gap_mm" not in lens:
        raise ProfileError(
            f"display '{profile.name}': lens.gap_mm is missing; the pitch of the sheet "
            "itself needs it"
        )
    _check_stripes(rest, name, f"display '{profile.name}'")
    setting = _setting(rest, profile.name)
    with exactly():
        exact = form.numbers(lens, setting)
        numbers = shortest(
            exact,
            lambda rounded: (
                _floats(form.lens(rounded, setting)) == _floats(form.lens(exact, setting))
            ),
        )
        said = form.lens(numbers, setting)
    rest["lens"] = {key: value for key, value in rest["lens"].items() if key not in said}
    return json_text({"schema": FORM_SCHEMA, "form": name, "numbers": numbers, "profile": rest})


def form_data(text: str, source: str) -> dict[str, Any]:
    """Data of a profile file that says the same as the text of such a file.

    Raises ProfileError, naming the field.
    """
    data = read_exact(text)
    name = data.get("form")
    if not isinstance(name, str) or name not in FORMS:
        raise ProfileError(f"{source}: form is {name!r:.60}; it should be {' or '.join(FORMS)}")
    form = FORMS[name]
    numbers = {field: _number(data.get("numbers"), field, source) for field in form.fields}
    rest = json.loads(text).get("profile")
    if not isinstance(rest, dict) or not isinstance(rest.get("lens", {}), dict):
        raise ProfileError(f"{source}: profile is missing; add the rest of the profile file")
    for extra in sorted(set(data) - {"schema", "form", "numbers", "profile"}):
        raise ProfileError(f"{source}: {extra:.60} is not a known field; remove it")
    setting = _setting(rest, source)
    _check_stripes(rest, name, f"{source}: profile")
    try:
        with exactly():
            lens = _floats(form.lens(numbers, setting))
    except ProfileError as cause:
        raise ProfileError(f"{source}: {cause}") from cause
    rest["lens"] = {**rest.get("lens", {}), **lens}
    return rest


def _floats(lens: dict[str, Decimal]) -> dict[str, float]:
    return {name: float(value) for name, value in lens.items()}


def _number(numbers: object, field: str, source: str) -> Decimal:
    """The number of a field, none of which may be outside ±10^9. Raises ProfileError."""
    value = numbers.get(field) if isinstance(numbers, dict) else None
    where = f"{source}: numbers.{field}"
    if value is None:
        raise ProfileError(f"{where} is missing; add it")
    if isinstance(value, bool) or not isinstance(value, Decimal | int | float):
        raise ProfileError(f"{where} is {value!r:.60}; it should be a number")
    number = Decimal(value)
    if not number.is_finite() or abs(number) > 10**12:
        raise ProfileError(f"{where} is {value}; it should be a finite number up to 1e12")
    if field in _LIMITS:
        low, high, what = _LIMITS[field]
        if not low < number < high:
            raise ProfileError(f"{where} is {value}; it should be {what}")
    return number


_LIMITS: dict[str, tuple[Decimal | int, Decimal | int, str]] = {
    "subpixels_per_lens": (0, 10**12, "above 0"),
    "pitch_mm": (0, 10**6, "above 0, in millimetres"),
    "gap_mm": (0, 10**6, "above 0, in millimetres"),
    "index": (Decimal("0.999"), 4, "from 1 to 4"),
    "tilt_deg": (-_QUARTER_TURN_DEG, _QUARTER_TURN_DEG, "between -90 and 90"),
}


def _setting(rest: dict[str, Any], source: str) -> Setting:
    """The setting of a profile's plain data. Raises ProfileError."""

    def positive(section: str, field: str, index: int | None = None) -> Decimal:
        part = rest.get(section)
        value = part.get(field) if isinstance(part, dict) else None
        name = f"profile.{section}.{field}" + ("" if index is None else f".{index}")
        if index is not None:
            value = value[index] if isinstance(value, list) and len(value) > index else None
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < 1e9:
            raise ProfileError(f"{source}: {name} is {value!r:.60}; it should be a number above 0")
        return Decimal(value)

    return Setting(
        positive("panel", "resolution_px", 0),
        positive("panel", "resolution_px", 1),
        positive("panel", "size_mm", 0),
        positive("panel", "size_mm", 1),
        positive("viewing", "views"),
        positive("viewing", "distance_mm"),
        **_stripes(rest),
    )


def _stripes(rest: dict[str, Any]) -> dict[str, Any]:
    """Origin and direction of stripes in a row."""
    subpixels = rest["panel"].get("subpixels") or {}
    if not isinstance(subpixels, dict) or subpixels.get("layout", "stripe") != "stripe":
        return {}
    order, origin = subpixels.get("order", "rgb"), subpixels.get("origin", "red-at-pixel-centre")
    backward = order == "bgr"
    place = "rgb".find(str(origin)[:1])
    return {"origin": 2 - place if backward else place, "reversed": backward}


def _check_stripes(rest: dict[str, Any], name: str, source: str) -> None:
    """Raise ProfileError for subpixels that the form cannot tell."""
    subpixels = rest["panel"].get("subpixels") or {}
    if name == "physical" or not isinstance(subpixels, dict):
        return
    layout, axis = subpixels.get("layout", "stripe"), subpixels.get("axis", "right")
    if layout != "stripe" or axis != "right":
        raise ProfileError(
            f"{source}: panel.subpixels is of layout {layout!r:.20}, axis {axis!r:.20}; the form "
            f"'{name}' takes stripes to the right, use 'physical' or the profile itself"
        )


# -- van Berkel: φ·X = k − origin + 3/2 + (H − ½ − l)·3·tan α − center·X ------------------------


def _from_berkel(numbers: Numbers, at: Setting) -> dict[str, Decimal]:
    subpixels, lean, offset = (numbers[field] for field in FORMS["van-berkel"].fields)
    return {
        "lens_count": 3 * at.width / subpixels,
        "drift": lean * at.height / at.width,
        "center": _settled((1 - at.origin + 3 * (at.height - _HALF) * lean - offset) / subpixels),
    }


def _to_berkel(lens: Numbers, at: Setting) -> dict[str, Decimal]:
    subpixels = 3 * at.width / lens["lens_count"]
    lean = lens["drift"] * at.width / at.height
    offset = 1 - at.origin + 3 * (at.height - _HALF) * lean - lens["center"] * subpixels
    return {"subpixels_per_lens": subpixels, "tan_alpha": lean, "k_off": offset}


# -- the sheet itself ------------------------------------------------------------------------


def _from_physical(numbers: Numbers, at: Setting) -> dict[str, Decimal]:
    pitch, tilt, gap, index, center = (numbers[field] for field in FORMS["physical"].fields)
    lean = tan(tilt * PI / 180)
    period = pitch * (1 + lean * lean).sqrt() * (1 + gap / (index * at.distance_mm))
    return {
        "lens_count": at.width_mm / period,
        "drift": lean * at.height_mm / at.width_mm,
        "center": center,
        "index": index,
        "gap_mm": gap,
    }


def _to_physical(lens: Numbers, at: Setting) -> dict[str, Decimal]:
    lean = lens["drift"] * at.width_mm / at.height_mm
    gap, index = lens["gap_mm"], lens["index"]
    period = at.width_mm / lens["lens_count"] / (1 + gap / (index * at.distance_mm))
    return {
        "pitch_mm": period / (1 + lean * lean).sqrt(),
        "tilt_deg": atan(lean, math.atan(lean)) * 180 / PI,
        "gap_mm": gap,
        "index": index,
        "center": lens["center"],
    }


# -- Leia: z = −φ − 1/(2·N), red's stripe at the origin ------------------------------------------


def _from_leia(numbers: Numbers, at: Setting) -> dict[str, Decimal]:
    across, down, colour, offset = (numbers[field] for field in FORMS["leia"].fields)
    if across == 0:
        raise ProfileError("numbers.m_x is 0; it should be lenses a pixel, with a minus")
    if abs(colour - (-across if at.reversed else across)) > abs(across) * _ROUNDED:
        raise ProfileError(
            f"numbers.m_c is {float(colour):g}; it should be {'minus ' if at.reversed else ''}m_x, "
            f"as profile.panel.subpixels.order has it"
        )
    count = -across * at.width
    drift = down * at.height / count
    left_top = count / (2 * at.width) + (at.height - _HALF) / at.height * drift * count
    return {
        "lens_count": count,
        "drift": drift,
        "center": _settled(left_top + offset + 1 / (2 * at.views) + _red(at) * count / at.width),
    }


def _to_leia(lens: Numbers, at: Setting) -> dict[str, Decimal]:
    count, drift = lens["lens_count"], lens["drift"]
    left_top = count / (2 * at.width) + (at.height - _HALF) / at.height * drift * count
    return {
        "m_x": -count / at.width,
        "m_y": drift * count / at.height,
        "m_c": (count if at.reversed else -count) / at.width,
        "b": lens["center"] - left_top - 1 / (2 * at.views) - _red(at) * count / at.width,
    }


def _settled(center: Decimal) -> Decimal:
    """A difference of large numbers without its last digits, so that 0 comes back as 0; of one that
    is itself too large for so many digits nothing is lost."""
    return center if abs(center) >= 10**15 else center.quantize(Decimal("1e-30"))


def _red(at: Setting) -> Decimal:
    """Where red's stripe lies from the origin stripe, in pixels to the right."""
    return Decimal((2 if at.reversed else 0) - at.origin) / 3


FORMS = {
    "van-berkel": Form(("subpixels_per_lens", "tan_alpha", "k_off"), _from_berkel, _to_berkel),
    "physical": Form(
        ("pitch_mm", "tilt_deg", "gap_mm", "index", "center"), _from_physical, _to_physical
    ),
    "leia": Form(("m_x", "m_y", "m_c", "b"), _from_leia, _to_leia),
}

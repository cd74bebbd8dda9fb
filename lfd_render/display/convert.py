"""Profiles in the words of other systems, and what these cannot say.

Whatever a format makes of a profile is read back: what came back otherwise is the report.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from lfd_render.display.forms import FORMS, form_text
from lfd_render.display.global3d import ini_text
from lfd_render.display.looking_glass import visual_json
from lfd_render.display.profile import DisplayProfile
from lfd_render.errors import UsageError

WRITERS: dict[str, Callable[[DisplayProfile], str]] = {
    "profile": DisplayProfile.to_json,
    "looking-glass": visual_json,
    "3d-global": ini_text,
    **{name: partial(form_text, name=name) for name in FORMS},
}


@dataclass(frozen=True)
class Difference:
    """A field that came back otherwise; None stands for one that is not there."""

    field: str
    was: Any
    became: Any


@dataclass(frozen=True)
class Conversion:
    """A profile in another format, what the format lost of it, and what reading gives."""

    text: str
    lost: tuple[Difference, ...]
    read_back: DisplayProfile


def convert(profile: DisplayProfile, to: str) -> Conversion:
    """The profile as a file of a format. Raises ProfileError where the format has no such file."""
    if to not in WRITERS:
        raise UsageError(f"format '{to}': unknown; use {', '.join(WRITERS)}")
    text = WRITERS[to](profile)
    back = DisplayProfile.from_json(text, source=f"display '{profile.name}' as {to}")
    return Conversion(text, tuple(differences(profile, back)), back)


def differences(one: DisplayProfile, other: DisplayProfile) -> Iterator[Difference]:
    """Fields in which two profiles differ, by their dotted names."""
    if one != other:
        yield from _differences("", _plain(one), _plain(other))


def _plain(profile: DisplayProfile) -> Any:
    return json.loads(profile.to_json())


def _differences(path: str, one: Any, other: Any) -> Iterator[Difference]:
    if isinstance(one, dict) and isinstance(other, dict):
        for key in {**one, **other}:
            inner = f"{path}.{key}" if path else key
            yield from _differences(inner, one.get(key), other.get(key))
    elif one != other:
        yield Difference(path, one, other)


def views_apart(one: DisplayProfile, other: DisplayProfile) -> float | None:
    """The most that two profiles of one panel differ by at its corners and middle, in views.

    None where the panels differ in pixels.
    """
    if one.resolution_px != other.resolution_px:
        return None
    width, height = one.resolution_px
    ends = [np.array(sorted({*range(min(4, n)), n // 2, *range(max(0, n - 4), n)})) for n in
            (width, height)]  # fmt: skip
    x, y = ends[0][None, :, None], ends[1][:, None, None]
    signed = [
        (-1 if tables.inverted else 1) * tables.phase_at(x, y)
        for tables in (one.phase_tables(), other.phase_tables())
    ]
    apart = signed[0] - signed[1]
    return float(np.abs(apart - np.rint(apart)).max()) * one.views

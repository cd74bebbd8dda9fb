"""`builtin:NAME?triangles=N`: scenes made by the program itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from urllib.parse import parse_qsl

from lfd_render.errors import SceneError
from lfd_render.scene.model import Scene
from lfd_render.scene.procedural.atrium import atrium
from lfd_render.scene.procedural.car import car
from lfd_render.scene.procedural.chart import chart
from lfd_render.scene.procedural.coconuts import coconuts
from lfd_render.scene.procedural.gallery import gallery
from lfd_render.scene.procedural.spheres import spheres

PREFIX = "builtin:"


@dataclass(frozen=True)
class Builtin:
    """A maker of scenes and the range of each of its whole-number options."""

    make: Callable[..., Scene]
    ranges: Mapping[str, tuple[int, int]]
    defaults: Mapping[str, int]


_MOST_TRIANGLES = 30_000_000
_TRIANGLES = (1_000, _MOST_TRIANGLES)

BUILTINS: dict[str, Builtin] = {
    "atrium": Builtin(
        atrium,
        {"triangles": (20_000, _MOST_TRIANGLES), "textures": (16, 4096)},
        {"triangles": 1_000_000, "textures": 1024},
    ),
    "car": Builtin(car, {"triangles": (20_000, _MOST_TRIANGLES)}, {"triangles": 300_000}),
    "chart": Builtin(chart, {"triangles": _TRIANGLES}, {"triangles": 100_000}),
    "coconuts": Builtin(
        coconuts,
        {"triangles": (50_000, _MOST_TRIANGLES), "textures": (16, 8192)},
        {"triangles": 2_000_000, "textures": 2048},
    ),
    "gallery": Builtin(
        gallery,
        {"triangles": _TRIANGLES, "textures": (16, 16384)},
        {"triangles": 1_000_000, "textures": 1024},
    ),
    "spheres": Builtin(spheres, {"triangles": _TRIANGLES}, {"triangles": 100_000}),
}


def load_builtin(source: str) -> Scene:
    """Make the scene that `builtin:NAME?option=value&…` names; raises SceneError."""
    builtin, options = parse_builtin(source)
    return builtin.make(**options)


def parse_builtin(source: str) -> tuple[Builtin, dict[str, int]]:
    """The maker that `builtin:NAME?option=value&…` names and what it is to be called with.

    Raises SceneError, listing the choices, on an unknown name or option or a value out of range.
    """
    name, _, query = source.removeprefix(PREFIX).partition("?")
    if name not in BUILTINS:
        raise SceneError(f"builtin: '{name}'; give one of {', '.join(sorted(BUILTINS))}")
    builtin = BUILTINS[name]
    options = dict(builtin.defaults)
    given: set[str] = set()
    for key, text in _query_items(query):
        if key not in builtin.ranges:
            raise SceneError(f"option: '{key}'; {name} takes {', '.join(sorted(builtin.ranges))}")
        if key in given:
            raise SceneError(f"option: '{key}' is given twice; give it once")
        given.add(key)
        options[key] = _whole_number(key, text, *builtin.ranges[key])
    return builtin, options


def _query_items(query: str) -> list[tuple[str, str]]:
    try:
        return parse_qsl(query, keep_blank_values=True, strict_parsing=bool(query))
    except ValueError:
        raise SceneError(f"options: '{query}'; write them as name=value&name=value") from None


def _whole_number(key: str, text: str, low: int, high: int) -> int:
    # isdecimal first: int() also takes signs, spaces, underscores and very long texts.
    value = int(text) if text.isascii() and text.isdecimal() and len(text) < 12 else None
    if value is None or not low <= value <= high:
        raise SceneError(f"{key}: '{text}'; give a whole number from {low} to {high}")
    return value

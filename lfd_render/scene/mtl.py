"""Materials of an MTL file, brought to metallic-roughness.

Kd and Ke are taken as linear. The Phong exponent becomes roughness by matching the width of the
highlight: roughness⁴ = 2 / (Ns + 2), as Beckmann's distribution relates them (Walter et al. 2007).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from lfd_render.errors import SceneError
from lfd_render.scene.files import SceneFiles
from lfd_render.scene.images import ImageRequest
from lfd_render.scene.model import Material, TextureSlot, Wrap

# Map options and how many values follow them.
_OPTION_VALUES = {
    "-blendu": 1, "-blendv": 1, "-boost": 1, "-bm": 1, "-cc": 1, "-clamp": 1, "-imfchan": 1,
    "-mm": 2, "-texres": 1, "-type": 1,
}  # fmt: skip
_VECTOR_OPTIONS = ("-o", "-s", "-t")  # one to three values
_IGNORED_MAPS = ("map_ka", "map_ks", "map_ns", "map_bump", "bump", "disp", "decal", "refl",
                 "map_pr", "map_pm", "map_ps")  # fmt: skip

# What surfaces are made of when the file does not say: light grey plastic.
DEFAULT = Material("default", (0.8, 0.8, 0.8, 1.0), metallic=0.0, roughness=0.6, double_sided=True)


@dataclass
class Palette:
    """The materials of all MTL files of one scene, by name, and the pictures they need."""

    files: SceneFiles
    warn: Callable[[str], None]
    entries: dict[str, dict[str, tuple[str, str]]] = field(default_factory=dict)
    requests: list[ImageRequest] = field(default_factory=list)
    _images: dict[str, int] = field(default_factory=dict)

    def read(self, data: bytes, source: str) -> None:
        """Take in the text of an MTL file; `source` is its name, for messages."""
        statements: dict[str, tuple[str, str]] | None = None
        for number, line in enumerate(data.decode("utf-8", "replace").splitlines(), 1):
            keyword, _, rest = line.partition("#")[0].strip().partition(" ")
            keyword, rest = keyword.lower(), rest.strip()
            if keyword == "newmtl":
                statements = self.entries.setdefault(rest, {})
            elif keyword and statements is not None:
                statements[keyword] = (rest, f"{source} line {number}: {keyword}")

    def material(self, name: str) -> Material:
        """One of the materials; a name that no file defines gives the default and a warning."""
        if name not in self.entries:
            self.warn(f"usemtl: '{name}' is not defined; it is drawn in grey")
            return DEFAULT
        return _Reader(self, name, self.entries[name]).material()

    def image(self, uri: str, label: str) -> int:
        """Position of a picture among those to decode; each file is read once."""
        if uri not in self._images:
            self._images[uri] = len(self.requests)
            self.requests.append(
                ImageRequest(uri, f"{label}: '{uri}'", lambda: self.files.read_name(uri, label))
            )
        return self._images[uri]


class _Reader:
    """One material's statements."""

    def __init__(self, palette: Palette, name: str, statements: dict[str, tuple[str, str]]) -> None:
        self._palette = palette
        self._name = name
        self._statements = statements

    def material(self) -> Material:
        for keyword in _IGNORED_MAPS:
            if keyword in self._statements:
                self._palette.warn(f"material '{self._name}': {keyword} is left out")
        red, green, blue = self._color("kd", 0.8)
        alpha = self._opacity()
        color_map = self._map("map_kd")
        cut_out = "map_d" in self._statements
        if cut_out and self._statements["map_d"][0] != self._statements.get("map_kd", ("", ""))[0]:
            self._palette.warn(f"material '{self._name}': map_d is left out; only map_Kd's own is")
            cut_out = False
        return Material(
            name=self._name,
            base_color=(1.0, 1.0, 1.0, alpha) if color_map else (red, green, blue, alpha),
            metallic=self._number("pm", 0.0, 1.0),
            roughness=self._roughness(),
            emissive=self._color("ke", 0.0, math.inf),
            alpha_mode="mask" if cut_out else "blend" if alpha < 1.0 else "opaque",
            double_sided=True,  # OBJ does not say, and its surfaces are often open
            base_color_texture=color_map,
            normal_texture=self._map("norm"),
            emissive_texture=self._map("map_ke"),
        )

    def _numbers(self, keyword: str) -> list[float]:
        """The finite numbers of a statement, none where it is absent."""
        rest, label = self._statements.get(keyword, ("", ""))
        try:
            values = [float(word) for word in rest.split()]
        except ValueError:
            values = [math.nan]
        if not all(map(math.isfinite, values)) or (label and not values):
            raise SceneError(f"{label}: '{rest}'; give finite numbers")
        return values

    def _number(self, keyword: str, default: float, high: float = math.inf) -> float:
        values = self._numbers(keyword) or [default]
        return min(max(values[-1], 0.0), high)

    def _color(self, keyword: str, default: float, high: float = 1.0) -> tuple[float, float, float]:
        rest, label = self._statements.get(keyword, ("", ""))
        if rest.startswith(("spectral", "xyz")):
            raise SceneError(f"{label}: '{rest}'; give red, green and blue")
        values = self._numbers(keyword) or [default]
        red, green, blue = values if len(values) == 3 else [values[0]] * 3
        return min(max(red, 0.0), high), min(max(green, 0.0), high), min(max(blue, 0.0), high)

    def _opacity(self) -> float:
        """`d`, or one minus `Tr`."""
        if "d" in self._statements:
            rest, label = self._statements["d"]
            self._statements["d"] = (rest.removeprefix("-halo"), label)
            return self._number("d", 1.0, 1.0)
        return 1.0 - self._number("tr", 0.0, 1.0)

    def _roughness(self) -> float:
        if "pr" in self._statements:
            return self._number("pr", 0.6, 1.0)
        if "ns" in self._statements:
            return float((2.0 / (self._number("ns", 0.0) + 2.0)) ** 0.25)
        return DEFAULT.roughness

    def _map(self, keyword: str) -> TextureSlot | None:
        if keyword not in self._statements:
            return None
        rest, label = self._statements[keyword]
        words, options = rest.split(), _MapOptions()
        at = 0
        while at < len(words) and words[at].startswith("-"):
            at = options.take(words, at, label)
        # A name may hold spaces, so it is what remains of the line itself.
        uri = rest.split(maxsplit=at)[-1] if at < len(words) else ""
        if not uri:
            raise SceneError(f"{label}: '{rest}'; give a picture's file name")
        image = self._palette.image(uri.replace("\\", "/"), f"material '{self._name}': {label}")
        return TextureSlot(
            image, wrap=(options.wrap, options.wrap), uv_transform=options.uv_transform()
        )


@dataclass
class _MapOptions:
    """Offset, scale and clamping of a map, with v upwards as OBJ counts it."""

    offset: tuple[float, float] = (0.0, 0.0)
    scale: tuple[float, float] = (1.0, 1.0)
    wrap: Wrap = "repeat"

    def take(self, words: list[str], at: int, label: str) -> int:
        """Read the option at a word; returns where the next one starts."""
        option = words[at].lower()
        if option in _VECTOR_OPTIONS:
            values: list[float] = []
            while len(values) < 3 and (value := _number(words, at + 1 + len(values))) is not None:
                values.append(value)
            if option == "-o":
                self.offset = _first_two(values, self.offset)
            elif option == "-s":
                self.scale = _first_two(values, self.scale)
            return at + 1 + len(values)
        if option not in _OPTION_VALUES:
            raise SceneError(f"{label}: option '{words[at]}'; it is not one of MTL's")
        if option == "-clamp" and words[at + 1 : at + 2] == ["on"]:
            self.wrap = "clamp"
        return at + 1 + _OPTION_VALUES[option]

    def uv_transform(self) -> NDArray[np.float64] | None:
        """The same for v downwards, [3, 3], or None where nothing is moved."""
        if self.offset == (0.0, 0.0) and self.scale == (1.0, 1.0):
            return None
        (offset_u, offset_v), (scale_u, scale_v) = self.offset, self.scale
        # 1 − ((1 − v)·s + o) = s·v + (1 − s − o)
        return np.array(
            [[scale_u, 0.0, offset_u], [0.0, scale_v, 1.0 - scale_v - offset_v], [0.0, 0.0, 1.0]]
        )


def _number(words: list[str], at: int) -> float | None:
    try:
        value = float(words[at])
    except (IndexError, ValueError):
        return None
    return value if math.isfinite(value) else None


def _first_two(values: list[float], default: tuple[float, float]) -> tuple[float, float]:
    return (values[0], values[1] if len(values) > 1 else default[1]) if values else default

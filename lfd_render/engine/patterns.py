"""Test patterns as jobs ask for them: the panel's pixels, or what an eye sees of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lfd_render.display.mount import stored
from lfd_render.display.patterns import COLOURS, PATTERNS, view_grating
from lfd_render.errors import OptionError
from lfd_render.panel.look import look_from

if TYPE_CHECKING:
    from lfd_render.display import DisplayProfile
    from lfd_render.engine.jobs import Pattern

PATTERN_COLOURS = ("white", *COLOURS)


def check_pattern(display: DisplayProfile, pattern: Pattern) -> None:
    """Raise what making a pattern would raise, before it is queued."""
    if pattern.kind not in PATTERNS:
        raise OptionError("kind", f"'{pattern.kind}'; use {', '.join(PATTERNS)}")
    if pattern.colour not in (None, *PATTERN_COLOURS):
        raise OptionError("colour", f"'{pattern.colour}'; use {', '.join(PATTERN_COLOURS)}")
    of_grating = {"view": pattern.view, "width": pattern.width, "colour": pattern.colour}
    for name, value in of_grating.items():
        if value is not None and pattern.kind != "grating":
            raise OptionError(name, f"goes with a grating, not with {pattern.kind}; leave it out")
    views = display.views
    if pattern.view is not None and not 0 <= pattern.view < views:
        raise OptionError("view", f"{pattern.view}; '{display.name}' has 0 to {views - 1}")
    if pattern.width is not None and not 1 <= pattern.width <= views:
        raise OptionError("width", f"{pattern.width}; give 1 to {views} views")
    through = pattern.through
    if through is None and (pattern.eye or pattern.size):
        name = "eye" if pattern.eye else "size"
        raise OptionError(name, "goes with through, the display that is looked at; leave it out")
    if through is not None and through.resolution_px != display.resolution_px:
        size = " × ".join(map(str, display.resolution_px))
        raise OptionError("through", f"'{through.name}' has another panel; give one of {size}")


def pattern_picture(display: DisplayProfile, pattern: Pattern) -> NDArray[np.uint8]:
    """The pattern as the panel takes it, or as an eye before the panel `through` sees it, uint8
    [y, x, 3]."""
    if pattern.kind == "grating":
        colour = pattern.colour or "white"
        lit = (0, 1, 2) if colour == "white" else (COLOURS.index(colour),)
        pixels = view_grating(display, pattern.view, pattern.width or 1, lit)
    else:
        pixels = PATTERNS[pattern.kind](display)
    if pattern.through is None:
        return stored(pixels, display.panel.mount)
    eye = pattern.eye or (0.0, 0.0, pattern.through.distance_mm)
    return look_from(pixels, pattern.through, eye, size_px=pattern.size)

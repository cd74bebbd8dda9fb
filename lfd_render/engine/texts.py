"""Options given as texts, on the command line and in a URL's query, and what they mean."""

import math
import re
from typing import Literal

from lfd_render.errors import OptionError

MAX_EXPOSURE_EV = 60


def parse_size(option: str, text: str | None, example: str = "480x360") -> tuple[int, int] | None:
    """The two numbers of an option's ``480x360``; None stays None. Raises OptionError."""
    if text is None:
        return None
    match = re.fullmatch(r"([1-9]\d{0,5})[x×]([1-9]\d{0,5})", text.strip().lower())
    if not match:
        raise OptionError(option, f"'{text}'; give columns x rows, as {example}")
    return int(match[1]), int(match[2])


def parse_views(text: str | None) -> int | Literal["continuous"] | None:
    """A number of views, or ``continuous``; None stays None. Raises OptionError."""
    if text is None:
        return None
    if text.strip().lower() == "continuous":
        return "continuous"
    if not re.fullmatch(r"[1-9]\d{0,5}", text.strip()):
        raise OptionError("views", f"'{text}'; give a whole number from 1, or continuous")
    return int(text)


def parse_supersample(text: str) -> tuple[int, int]:
    """Pixels each way and eyes a view of ``none``, ``spatial``, ``angular`` or ``2x3``. Raises
    OptionError."""
    named = {"none": (1, 1), "spatial": (2, 1), "angular": (1, 2)}
    chosen = text.strip().lower()
    if chosen in named:
        return named[chosen]
    match = re.fullmatch(r"([1-9]\d?)[x×]([1-9]\d?)", chosen)
    if not match:
        raise OptionError(
            "supersample", f"'{text}'; give none, spatial, angular, or pixels x eyes, as 2x3"
        )
    return int(match[1]), int(match[2])


def parse_exposure(text: str | None) -> float | None:
    """The factor of ``0.5``, or of ``-1EV``: so many doublings; None stays None. Raises
    OptionError."""
    if text is None:
        return None
    number = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:e[+-]?[0-9]+)?"
    match = re.fullmatch(rf"({number})(ev)?", text.strip().lower())
    if match:
        value = float(match[1])
        stops = value if match[2] else math.log2(value) if 0 < value < math.inf else math.inf
        if abs(stops) <= MAX_EXPOSURE_EV:
            return 2.0**value if match[2] else value
    raise OptionError(
        "exposure",
        f"'{text}'; give a factor above 0, as 0.5, or stops, as -1.5EV, "
        f"at most {MAX_EXPOSURE_EV} of them",
    )

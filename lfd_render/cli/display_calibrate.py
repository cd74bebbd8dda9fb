"""`lfd-render display calibrate`: a profile by eye, step by step, with a pattern on the display."""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lfd_render.cli.console import say
from lfd_render.cli.outputs import check_picture_output
from lfd_render.errors import LfdError, UsageError

if TYPE_CHECKING:
    from lfd_render.display import DisplayProfile

HELP = (
    "+0.5 or -0.5 adds, =479.4 sets, an empty line accepts and goes on, b goes back, r shows the "
    "ruler or the pattern, q ends without a profile"
)


@dataclass(frozen=True)
class Stage:
    """One number to adjust, and what to look for."""

    field: str
    unit: str
    ruler: str
    task: str


STAGES = (
    Stage(
        "lens_count",
        "lenses",
        "pitch-ruler",
        "Stand before the middle, at the viewing distance, and close one eye. Count the bright and "
        "dark fringes across a row: change the count by that many, until a row is evenly lit. The "
        "wrong sign makes more of them",
    ),
    Stage(
        "tilt_deg",
        "degrees",
        "tilt-ruler",
        "Now look up and down a column: change the tilt until it is evenly lit, too",
    ),
    Stage(
        "center",
        "lenses",
        "numbers",
        "The panel is of one brightness. Change the center until it is brightest: 0.5 is from "
        "brightest to darkest",
    ),
)


def calibrate(
    *,
    output: Annotated[
        str, typer.Option("--output", "-o", metavar="FILE", help=".json to write in the end.")
    ],
    display: Annotated[
        str, typer.Option("--display", metavar="NAME|FILE", help="Profile to start from.")
    ],
    pattern: Annotated[
        str,
        typer.Option(
            metavar="FILE",
            help="PNG to write anew at each step; keep it open, full-screen, pixel for pixel.",
        ),
    ],
    name: Annotated[str | None, typer.Option(help="Name of the profile.")] = None,
) -> None:
    """Adjust lens count, tilt and center by eye; answers come from the terminal or a pipe."""
    check_picture_output(output, formats=["json"])
    check_picture_output(pattern)
    if "-" in (output, pattern):
        raise UsageError("-: the guide needs files; give a .json and a .png")

    from lfd_render.display import DisplayProfile  # noqa: PLC0415 (keeps --help quick)
    from lfd_render.display.calibration import by_eye  # noqa: PLC0415

    profile = DisplayProfile.load(display)
    say(f"Show {pattern} on the display, full-screen, pixel for pixel. {HELP}.")
    stage, ruler = 0, False
    while stage < len(STAGES):
        now = STAGES[stage]
        _show(profile, now, pattern, ruler)
        say(f"{stage + 1} of {len(STAGES)}. {now.task}.")
        answer = _answer(f"{now.field} {_value(profile, now.field):.6g} {now.unit}")
        match answer:
            case "":
                stage, ruler = stage + 1, False
            case "b":
                stage, ruler = max(0, stage - 1), False
            case "r":
                ruler = not ruler
            case "q":
                raise UsageError("ended before the last step; nothing is written")
            case _:
                profile = _answered(profile, now.field, answer)
    by_eye.finished(profile, name).save(Path(output))
    say(
        f"{output}: {profile.lens_count:.4f} lenses, tilt {math.degrees(profile.tilt_rad):.4f}°, "
        f"center {profile.center:.5f}; 'display fit' makes it exact"
    )


def _show(profile: DisplayProfile, stage: Stage, path: str, ruler: bool) -> None:
    from lfd_render.display.mount import stored  # noqa: PLC0415 (keeps --help quick)
    from lfd_render.display.patterns import PATTERNS, ruler_width, view_grating  # noqa: PLC0415
    from lfd_render.panel.picture import write_png  # noqa: PLC0415

    wide = ruler_width(profile)
    picture = PATTERNS[stage.ruler](profile) if ruler else view_grating(profile, None, wide)
    write_png(path, stored(picture, profile.panel.mount))


def _answer(prompt: str) -> str:
    """A line of the person's. Raises UsageError where there are no more."""
    sys.stderr.write(f"{prompt}: ")
    sys.stderr.flush()
    line = sys.stdin.readline()
    if not line:
        raise UsageError(
            "the answers end before the last step and nothing is written; accept each step with an "
            "empty line"
        )
    if not sys.stdin.isatty():
        say(line.rstrip("\n"))
    return line.strip()


def _value(profile: DisplayProfile, field: str) -> float:
    if field == "tilt_deg":
        return math.degrees(profile.tilt_rad)
    return profile.lens_count if field == "lens_count" else profile.center


def _answered(profile: DisplayProfile, field: str, answer: str) -> DisplayProfile:
    """The profile with a changed number; as it was, and a line saying why, where it cannot be."""
    from lfd_render.display.calibration.by_eye import adjusted  # noqa: PLC0415 (keeps --help quick)

    sign = answer[0]
    try:
        number = float(answer.removeprefix("="))
    except ValueError:
        number = math.nan
    if sign not in "+-=" or not math.isfinite(number):
        say(f"'{answer}' is no answer: {HELP}.")
        return profile
    value = number if sign == "=" else _value(profile, field) + number
    try:
        return adjusted(profile, field, value)
    except LfdError as problem:
        say(f"{problem}")
        return profile

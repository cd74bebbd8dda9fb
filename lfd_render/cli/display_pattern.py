"""`lfd-render display pattern`: test patterns of a display, to look at or to photograph."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lfd_render.cli import options
from lfd_render.cli.console import print_json, progress, say
from lfd_render.cli.outputs import (
    check_folder_output,
    check_picture_output,
    filling,
    write_picture,
)
from lfd_render.errors import UsageError

if TYPE_CHECKING:
    from lfd_render.display import DisplayProfile


class Kind(StrEnum):
    """Which pattern."""

    GRATING = "grating"
    PHASES = "phases"
    NUMBERS = "numbers"
    PITCH_RULER = "pitch-ruler"
    TILT_RULER = "tilt-ruler"
    CROSSTALK = "crosstalk"
    WHITE = "white"


class Colour(StrEnum):
    """Which subpixels."""

    WHITE = "white"
    RED = "red"
    GREEN = "green"
    BLUE = "blue"


def pattern(
    kind: Annotated[Kind, typer.Argument(help="Which pattern; phases writes a folder.")],
    *,
    output: Annotated[
        str,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE|FOLDER",
            help=".png to write, - for stdout; or a folder.",
        ),
    ],
    display: options.DisplayOption = options.DEFAULT_DISPLAY,
    view: Annotated[
        int | None, typer.Option(help="grating: view that is lit; the middle one.")
    ] = None,
    width: Annotated[
        int | None, typer.Option(help="grating: how many views about it are lit; 1.")
    ] = None,
    colour: Annotated[
        Colour | None, typer.Option(help="grating, phases: subpixels that are lit; all.")
    ] = None,
    steps: Annotated[int | None, typer.Option(help="phases: shifts in a set, 3 to 32; 4.")] = None,
    json: options.JsonOption = False,
) -> None:
    """Write a test pattern KIND as the panel's own pixels."""
    _check_options(kind, {"view": view, "width": width, "colour": colour, "steps": steps})
    folder = check_folder_output(output) if kind is Kind.PHASES else None
    if folder is None:
        check_picture_output(output, json)

    from lfd_render.display import DisplayProfile  # noqa: PLC0415 (keeps --help quick)
    from lfd_render.display.mount import stored  # noqa: PLC0415
    from lfd_render.display.patterns import COLOURS, PATTERNS, view_grating  # noqa: PLC0415
    from lfd_render.panel.picture import write_png  # noqa: PLC0415

    profile = DisplayProfile.load(display)  # a guess is what patterns are for: nothing to warn of
    chosen = (0, 1, 2) if colour in (None, Colour.WHITE) else (COLOURS.index(colour),)
    if folder is not None:
        with progress("Writing"):
            files = _write_phases(folder, profile, steps, chosen)
        say(f"{folder}: {len(files)} patterns for '{profile.name}'; show each, photograph each")
    else:
        if kind is Kind.GRATING:
            picture = view_grating(profile, view, 1 if width is None else width, chosen)
        else:
            picture = PATTERNS[kind](profile)
        taken = stored(picture, profile.panel.mount)
        write_picture(output, lambda file: write_png(file, taken))
        files = [output]
        size = " × ".join(map(str, profile.resolution_px))
        say(f"{output}: {kind} for '{profile.name}', {size}")
    if json:
        print_json({"output": files, "display": profile.name, "kind": str(kind)})


def _check_options(kind: Kind, given: dict[str, object]) -> None:
    """Raise UsageError for options that say nothing to this kind."""
    takes = {Kind.GRATING: ("view", "width", "colour"), Kind.PHASES: ("colour", "steps")}
    for name, value in given.items():
        if value is not None and name not in takes.get(kind, ()):
            kinds = " and ".join(k for k, names in takes.items() if name in names)
            raise UsageError(f"--{name}: goes with {kinds}, not with {kind}; leave it out")


def _write_phases(
    folder: Path, profile: DisplayProfile, steps: int | None, colours: tuple[int, ...]
) -> list[str]:
    """The white pattern and all steps; all files appear or none."""
    from lfd_render.display.mount import stored  # noqa: PLC0415 (keeps --help quick)
    from lfd_render.display.patterns import (  # noqa: PLC0415 (keeps --help quick)
        STEPS,
        blank,
        phase_pattern,
        phase_steps,
    )
    from lfd_render.panel.picture import write_png  # noqa: PLC0415

    wanted = phase_steps(profile, STEPS if steps is None else steps, colours)
    mount = profile.panel.mount
    names = ["white.png"] + [f"{step.name}.png" for step in wanted]
    with filling(folder) as temporary:
        write_png(temporary / names[0], stored(blank(profile, 255), mount))
        for name, step in zip(names[1:], wanted, strict=True):
            write_png(temporary / name, stored(phase_pattern(profile, step), mount))
    return [str(folder / name) for name in names]

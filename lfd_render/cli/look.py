"""`lfd-render look`: what an eye in front of the display sees of a panel image."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from lfd_render.cli import options
from lfd_render.cli.console import Stopwatch, print_json, progress, say
from lfd_render.cli.inputs import display_warnings, load_display, load_eia
from lfd_render.cli.outputs import (
    STDOUT,
    check_folder_output,
    check_picture_output,
    filling,
    remove_others,
    write_picture,
)
from lfd_render.engine.texts import parse_size
from lfd_render.panel.eyes import EYES_APART_MM, stands


class Optics(StrEnum):
    """How a lens sends light."""

    RIG = "rig"
    SLAB = "slab"


def look(
    eia: Annotated[str, typer.Argument(metavar="EIA", help="Panel image of the display.")],
    *,
    angle: Annotated[
        float | None,
        typer.Option(metavar="DEG", help="Where the eye is; positive: to the right."),
    ] = None,
    eye: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,Z",
            help="Where the eye is: mm right, up and near from the panel's centre.",
        ),
    ] = None,
    sweep: Annotated[
        str | None,
        typer.Option(
            metavar="FROM:TO:N",
            help="N angles in degrees: a strip of pictures, or frame_000.png … in a folder.",
        ),
    ] = None,
    stereo: Annotated[
        bool, typer.Option("--stereo", help="Two eyes side by side, the left one's picture first.")
    ] = False,
    eyes_apart: Annotated[
        float, typer.Option(metavar="MM", min=0.0, help="With --stereo: how far apart they are.")
    ] = EYES_APART_MM,
    output: Annotated[
        str,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE|FOLDER",
            help="PNG to write; - for stdout; of a sweep, a folder gets its frames.",
        ),
    ],
    display: options.DisplayOption = options.DEFAULT_DISPLAY,
    views: Annotated[
        int | None, typer.Option(min=1, help="Number of views woven in; else as the file says.")
    ] = None,
    view_size: options.ViewSizeOption = None,
    crosstalk: Annotated[
        float | None,
        typer.Option(
            metavar="VIEWS",
            min=0.0,
            help="Standard deviation of a lens's angular response; else the display's own.",
        ),
    ] = None,
    optics: Annotated[
        Optics,
        typer.Option(help="rig: each view goes where it was seen from; slab: by Snell's law."),
    ] = Optics.RIG,
    json: options.JsonOption = False,
) -> None:
    """Show a panel image as an eye in front of the display sees it."""
    size = parse_size("view_size", view_size)
    as_frames = sweep is not None and output != STDOUT and not Path(output).suffix
    if as_frames:
        folder = check_folder_output(output)
    else:
        check_picture_output(output, json)

    from lfd_render.panel.look import look_from  # noqa: PLC0415 (keeps --help quick)
    from lfd_render.panel.picture import side_by_side, write_png  # noqa: PLC0415

    watch = Stopwatch()
    with watch.span("load"):
        profile = load_display(display)
        places = stands(profile, angle, eye, sweep)
        panel = load_eia(eia, profile)
    with watch.span("look"), progress("Looking"):
        seen = [
            side_by_side(
                [
                    look_from(
                        panel.pixels, profile, at, views or panel.eye_views, size,
                        sigma_views=crosstalk, optics=optics.value,
                    )
                    for at in place.eyes(eyes_apart if stereo else None)
                ]
            )
            for place in places
        ]  # fmt: skip
    with watch.span("encode"):
        if as_frames:
            names = [f"frame_{index:03d}.png" for index in range(len(seen))]
            with filling(folder) as temporary:
                for name, picture in zip(names, seen, strict=True):
                    write_png(temporary / name, picture)
            remove_others(folder, [folder / name for name in names], "frame")
        else:
            strip = side_by_side(seen)
            write_picture(output, lambda file: write_png(file, strip))

    height, width = seen[0].shape[:2]
    if json:
        result = {
            "output": [str(folder / name) for name in names] if as_frames else output,
            "display": profile.name,
            "eyes_mm": [place.eyes(eyes_apart if stereo else None) for place in places],
            "view_size": [width, height],
            "warnings": [*display_warnings(profile), *panel.warnings],
            "timings_ms": watch.finish(),
        }
        print_json(result if angle is None else result | {"angle_deg": angle})
    said = places[0].said if len(places) == 1 else f"{places[0].said} to {places[-1].said}"
    pictures = "" if len(seen) == 1 else f"{len(seen)} pictures of "
    say(f"{output}: {pictures}{width} × {height}, seen from {said}")

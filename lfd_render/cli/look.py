"""`lfd-render look`: what an eye in front of the display sees of a panel image."""

from __future__ import annotations

import math
from typing import Annotated

import typer

from lfd_render.cli import options
from lfd_render.cli.console import Stopwatch, print_json, progress, say
from lfd_render.cli.inputs import display_warnings, load_display, load_eia
from lfd_render.cli.outputs import check_picture_output, write_picture


def look(
    eia: Annotated[str, typer.Argument(metavar="EIA", help="Panel image of the display.")],
    *,
    angle: Annotated[
        float, typer.Option(metavar="DEG", help="Where the eye is; positive: to the right.")
    ],
    output: Annotated[
        str, typer.Option("--output", "-o", metavar="FILE", help="PNG to write; - for stdout.")
    ],
    display: options.DisplayOption = options.DEFAULT_DISPLAY,
    views: Annotated[
        int | None, typer.Option(min=1, help="Number of views woven in; else as the file says.")
    ] = None,
    view_size: options.ViewSizeOption = None,
    json: options.JsonOption = False,
) -> None:
    """Show a panel image as seen from an angle, without crosstalk."""
    size = options.parse_view_size(view_size)
    check_picture_output(output, json)

    from lfd_render.panel.look import look as look_at  # noqa: PLC0415 (keeps --help quick)
    from lfd_render.panel.picture import write_png  # noqa: PLC0415

    watch = Stopwatch()
    with watch.span("load"):
        profile = load_display(display)
        panel = load_eia(eia, profile)
    with watch.span("look"), progress("Looking"):
        seen = look_at(
            panel.pixels, profile, math.radians(angle), views=views or panel.views, size_px=size
        )
    with watch.span("encode"):
        write_picture(output, lambda file: write_png(file, seen))

    height, width = seen.shape[:2]
    if json:
        print_json(
            {
                "output": output,
                "display": profile.name,
                "angle_deg": angle,
                "view_size": [width, height],
                "warnings": [*display_warnings(profile), *panel.warnings],
                "timings_ms": watch.finish(),
            }
        )
    say(f"{output}: {width} × {height}, seen from {angle:g}°")

"""`lfd-render look`: what an eye in front of the display sees of a panel image."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Annotated

import typer

from lfd_render.cli import options
from lfd_render.cli.console import Stopwatch, print_json, progress, say, warn
from lfd_render.cli.inputs import display_warnings, load_display
from lfd_render.cli.outputs import check_picture_output, write_picture
from lfd_render.errors import PictureError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from lfd_render.display import DisplayProfile


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
        pixels, woven = _read_panel_image(eia, profile)
    with watch.span("look"), progress("Looking"):
        seen = look_at(pixels, profile, math.radians(angle), views=views or woven, size_px=size)
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
                "warnings": display_warnings(profile),
                "timings_ms": watch.finish(),
            }
        )
    say(f"{output}: {width} × {height}, seen from {angle:g}°")


def _read_panel_image(eia: str, profile: DisplayProfile) -> tuple[NDArray[np.uint8], int | None]:
    """Pixels, uint8 [y, x, 3], and the number of views woven in where the file says it.

    Raises PictureError for a file that is no picture of the display's size.
    """
    from lfd_render.panel.picture import read_picture, read_png_text  # noqa: PLC0415

    pixels, text = read_picture(eia), read_png_text(eia)
    made_for = text.get("lfd:profile", "an unnamed display")
    width, height = profile.resolution_px
    if pixels.shape[:2] != (height, width):
        raise PictureError(
            f"{eia}: {pixels.shape[1]} x {pixels.shape[0]} pixels, made for {made_for}; "
            f"the display '{profile.name}' takes {width} x {height}, give another --display"
        )
    if text.get("lfd:profile-hash", profile.hash) != profile.hash:
        warn(f"{eia}: made for {made_for}, whose figures differ from '{profile.name}'")
    views = text.get("lfd:views", "")
    return pixels, int(views) if re.fullmatch(r"[1-9]\d{0,3}", views) else None

"""`lfd-render display diff` and `map`: what profiles do to the subpixels of a panel."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lfd_render.cli import options
from lfd_render.cli.console import print_json, print_text, progress, say
from lfd_render.cli.display_profiles import DisplayArgument
from lfd_render.cli.inputs import load_display
from lfd_render.cli.outputs import check_picture_output, write_picture
from lfd_render.errors import UsageError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

ViewCountOption = Annotated[
    int | None, typer.Option(min=1, help="Number of views; else the display's.")
]


def diff(
    display: DisplayArgument,
    other: Annotated[str, typer.Argument(metavar="OTHER", help="Another profile of the panel.")],
    *,
    views: ViewCountOption = None,
    picture: Annotated[
        str | None,
        typer.Option(metavar="FILE", help="PNG of the difference over the panel; - for stdout."),
    ] = None,
    json: options.JsonOption = False,
) -> None:
    """By how many views a picture made for OTHER is off on DISPLAY, and which fields differ."""
    from lfd_render.display.convert import differences  # noqa: PLC0415 (keeps --help quick)
    from lfd_render.panel.check import view_errors  # noqa: PLC0415

    if picture is not None:
        check_picture_output(picture, json)
    one, two = load_display(display), load_display(other)
    with progress("Comparing"):
        errors = view_errors(one, two, views or one.views)
    fields = [vars(difference) for difference in differences(one, two)]
    if picture is not None:
        from lfd_render.panel.picture import write_png  # noqa: PLC0415

        pixels = errors.picture()
        write_picture(picture, lambda file: write_png(file, pixels))
    numbers = errors.to_json_dict()
    if json:
        print_json(
            {"display": one.name, "other": two.name, "views": views or one.views, **numbers,
             "picture": picture, "fields": fields}
        )  # fmt: skip
        return
    if picture == "-":
        return
    lines = [f"{name:20} {_worded(value)}" for name, value in numbers.items()]
    lines += [
        f"{field['field']}: {str(field['was'])[:60]} or {str(field['became'])[:60]}"
        for field in fields
    ]
    print_text("\n".join(lines))


def _worded(value: Any) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{key.replace('_', ' ')} {part:+.3f}" for key, part in value.items())
    if isinstance(value, list):
        return ", ".join(f"{part:+.3f}" for part in value)
    return f"{value:.4f}"


def view_map(
    display: DisplayArgument,
    *,
    output: Annotated[
        str,
        typer.Option(
            "--output", "-o", metavar="FILE",
            help=".npy: uint16 [y, x, channel]; .png: 8 bits a channel, up to 256 views.",
        ),
    ],
    views: ViewCountOption = None,
    json: options.JsonOption = False,
) -> None:  # fmt: skip
    """Write which view each subpixel of the panel shows, view 0 leftmost."""
    kind = check_picture_output(output, json, ["npy", "png"])
    profile = load_display(display)
    count = views or profile.views
    if kind == "png" and count > 256:
        raise UsageError(f"{output}: {count} views do not fit into 8 bits; give a name in .npy")
    from lfd_render.display.mount import stored  # noqa: PLC0415 (keeps --help quick)

    index = stored(profile.view_index_map(count), profile.panel.mount)
    write_picture(output, lambda file: _write(file, index, str(kind)))
    height, width, _ = index.shape
    if json:
        print_json({"output": output, "display": profile.name, "views": count,
                    "shape": [height, width, 3]})  # fmt: skip
    say(f"{output}: {width} × {height}, the view of each subpixel, of {count}")


def _write(path: Path, index: NDArray[np.uint16], kind: str) -> None:
    import numpy  # noqa: PLC0415 (keeps --help quick)

    if kind == "png":
        from lfd_render.panel.picture import write_png  # noqa: PLC0415

        write_png(path, index.astype(numpy.uint8))
        return
    from lfd_render.display.files import replacing  # noqa: PLC0415

    with replacing(path) as temporary, temporary.open("wb") as file:
        numpy.save(file, index)

"""`lfd-render quilt`: all views of a scene tiled in one picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lfd_render.cli import options
from lfd_render.cli.bundle import QUILT, with_choices
from lfd_render.cli.console import Stopwatch, print_json, progress, say, warn
from lfd_render.cli.inputs import (
    display_warnings,
    load_display,
    load_scene,
    warn_of_light,
)
from lfd_render.cli.outputs import STDOUT, check_picture_output, write_picture
from lfd_render.engine.choices import Choices
from lfd_render.engine.texts import parse_size
from lfd_render.errors import UsageError

if TYPE_CHECKING:
    from lfd_render.panel.quilt import QuiltSize

_OTHER_KINDS = (".jpg", ".jpeg", ".webp", ".tif", ".tiff", ".bmp", ".exr", ".raw")


@with_choices(*QUILT)
def quilt(
    scene: options.SceneArgument,
    *,
    output: Annotated[
        str,
        typer.Option(
            "--output",
            "-o",
            metavar="NAME",
            help="PNG to write; its tiling is added to the name, as in NAME_qs8x6a0.75.png. "
            "- for stdout.",
        ),
    ],
    display: options.DisplayOption = options.DEFAULT_DISPLAY,
    choices: Choices,
    quilt: Annotated[
        str | None,
        typer.Option(metavar="DEVICE", help="Tiles and size by device: portrait, go, 16-gen2, …"),
    ] = None,
    tiles: options.TilesOption = None,
    size: Annotated[
        str | None,
        typer.Option(metavar="WxH", help="Pixels of the quilt; else views of the display's size."),
    ] = None,
    device: options.DeviceOption = "auto",
    json: options.JsonOption = False,
) -> None:
    """Render all views of SCENE into one picture, view 0 bottom-left, rows going up."""
    tiling = parse_size("tiles", tiles, "8x6")
    pixels = parse_size("size", size)
    options.check_device(device)
    suffix = Path(output).suffix.lower()
    if suffix in _OTHER_KINDS:
        raise UsageError(f"{output}: suffix '{suffix}'; a quilt is written as .png")
    if output != STDOUT and suffix != ".png":
        output += ".png"
    check_picture_output(output, json)

    from lfd_render.engine.quilts import chosen_size  # noqa: PLC0415 (keeps --help quick)

    watch = Stopwatch()
    with watch.span("load"), progress("Loading"):
        profile = load_display(display)
        quilt_size = chosen_size(profile, quilt, tiling, pixels)
        aspect = profile.size_mm[0] / profile.size_mm[1]
        output = output if output == STDOUT else str(_named(output, quilt_size, aspect))
        loaded = load_scene(scene)
        window = choices.window(loaded, profile)
        warn_of_light(loaded, choices)

    from lfd_render.panel.quilt import Quilt  # noqa: PLC0415 (keeps --help quick)
    from lfd_render.renderer import Renderer  # noqa: PLC0415

    with watch.span("render"), progress("Rendering"), Renderer(device=device) as renderer:
        tiled = {"views": quilt_size.views, "view_size": quilt_size.view_px}
        pictures = renderer.views(loaded, profile, window, **choices.options() | tiled)
        said = renderer.warnings
    for warning in said:
        if warning not in loaded.warnings:  # those were said when it was loaded
            warn(f"{scene}: {warning}")
    made = Quilt(
        pictures,
        quilt_size.columns,
        quilt_size.rows,
        aspect,
        (quilt_size.width_px, quilt_size.height_px),
        {
            "lfd:profile": profile.name,
            "lfd:profile-hash": profile.hash,
            "lfd:technique": choices.technique,
            "lfd:preset": choices.preset,
            "lfd:seed": str(choices.seed),
        },
    )
    with watch.span("encode"), progress("Writing"):
        write_picture(output, made.write)

    width, height = quilt_size.view_px
    if json:
        print_json(
            {
                "output": output,
                "display": profile.name,
                "technique": choices.technique,
                "preset": choices.preset,
                "views": quilt_size.views,
                "tiles": [quilt_size.columns, quilt_size.rows],
                "size": [quilt_size.width_px, quilt_size.height_px],
                "view_size": [width, height],
                "aspect": aspect,
                "seed": choices.seed,
                "camera": window.to_json_dict(),
                "warnings": [*display_warnings(profile), *said],
                "timings_ms": watch.finish(),
            }
        )
    say(
        f"{output}: {quilt_size.columns} × {quilt_size.rows} views of {width} × {height}, "
        f"view 0 bottom-left"
    )


def _named(output: str, size: QuiltSize, aspect: float) -> Path:
    """The output's name with the tiling in it. Raises UsageError where it names another."""
    from lfd_render.panel.quilt_names import QuiltLayout, named_path  # noqa: PLC0415

    return named_path(output, QuiltLayout(size.columns, size.rows, aspect))

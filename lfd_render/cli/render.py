"""`lfd-render render`: a scene becomes the panel image of a display."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated

import typer

from lfd_render.cli import options
from lfd_render.cli.bundle import PANEL_IMAGE, with_choices
from lfd_render.cli.console import Stopwatch, print_json, progress, progress_bar, say, warn
from lfd_render.cli.inputs import (
    display_warnings,
    load_display,
    load_scene,
    warn_of_light,
)
from lfd_render.cli.outputs import check_picture_output, write_picture
from lfd_render.engine.choices import Choices


@with_choices(*PANEL_IMAGE)
def render(
    scene: options.SceneArgument,
    *,
    output: Annotated[
        str,
        typer.Option(
            "--output", "-o", metavar="FILE", help=".png, .exr or .raw to write; - for stdout."
        ),
    ],
    format: options.FormatOption = None,
    display: options.DisplayOption = options.DEFAULT_DISPLAY,
    choices: Choices,
    repeat: Annotated[
        int, typer.Option(min=1, help="Render N frames with a moving camera; time their median.")
    ] = 1,
    device: options.DeviceOption = "auto",
    json: options.JsonOption = False,
) -> None:
    """Render SCENE into the panel image (EIA) of a display."""
    options.check_device(device)
    kind = check_picture_output(output, json, list(options.Format), format)

    watch = Stopwatch()
    with watch.span("load"), progress("Loading"):
        profile = load_display(display)
        loaded = load_scene(scene)
        window = choices.window(loaded, profile)
        warn_of_light(loaded, choices)

    from lfd_render.renderer import Renderer  # noqa: PLC0415 (keeps --help quick)

    shown = progress_bar if choices.preset == "gold" or choices.views == "continuous" else _status
    with shown("Rendering") as done, Renderer(device=device) as renderer:
        eia = renderer.render(
            loaded,
            profile,
            window,
            progress=done,
            # Views are woven faster where nobody asks for linear pixels.
            linear=kind == "exr",
            repeat=repeat,
            effort=json,
            **choices.options(),
        )
    with watch.span("encode"), progress("Writing"):
        write_picture(output, lambda file: eia.save(file, kind))

    for warning in eia.report["warnings"]:
        if warning not in loaded.warnings:  # those were said when it was loaded
            warn(f"{scene}: {warning}")
    load_ms, encode_ms = watch.timings_ms["load"], watch.timings_ms["encode"]
    watch.timings_ms = {"load": load_ms, **eia.report["timings_ms"], "encode": encode_ms}
    if json:
        result = {"output": output, "display": profile.name, "seed": choices.seed, "repeat": repeat}
        warnings = [*display_warnings(profile), *eia.report["warnings"]]
        print_json(result | eia.report | {"warnings": warnings, "timings_ms": watch.finish()})
    height, width = eia.pixels.shape[:2]
    say(
        f"{output}: {width} × {height}, {eia.report['views']} views by {choices.technique}, "
        f"a frame in {watch.timings_ms['frame']:.0f} ms on {eia.report['renderer']}"
    )


@contextmanager
def _status(message: str) -> Iterator[None]:
    """What is shown of work too short for a bar."""
    with progress(message):
        yield None

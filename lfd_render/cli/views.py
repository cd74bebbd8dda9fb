"""`lfd-render views`: the single upright views of a scene."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lfd_render.cli import options
from lfd_render.cli.bundle import VIEWS, with_choices
from lfd_render.cli.console import Stopwatch, print_json, progress, say, warn
from lfd_render.cli.inputs import (
    display_warnings,
    load_display,
    load_scene,
    warn_of_light,
)
from lfd_render.cli.outputs import check_folder_output, filling, remove_others
from lfd_render.engine.choices import Choices

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@with_choices(*VIEWS)
def views(
    scene: options.SceneArgument,
    *,
    output: Annotated[
        str,
        typer.Option(
            "--output", "-o", metavar="FOLDER", help="Folder for view_000.png (leftmost) and on."
        ),
    ],
    display: options.DisplayOption = options.DEFAULT_DISPLAY,
    choices: Choices,
    device: options.DeviceOption = "auto",
    json: options.JsonOption = False,
) -> None:
    """Write the single upright views of SCENE, view_000.png leftmost."""
    options.check_device(device)
    folder = check_folder_output(output)

    watch = Stopwatch()
    with watch.span("load"), progress("Loading"):
        profile = load_display(display)
        loaded = load_scene(scene)
        window = choices.window(loaded, profile)
        warn_of_light(loaded, choices)

    from lfd_render.renderer import Renderer  # noqa: PLC0415 (keeps --help quick)

    with watch.span("render"), progress("Rendering"), Renderer(device=device) as renderer:
        pictures = renderer.views(loaded, profile, window, **choices.options())
        said = renderer.warnings
    for warning in said:
        if warning not in loaded.warnings:  # those were said when it was loaded
            warn(f"{scene}: {warning}")
    with watch.span("encode"), progress("Writing"):
        text = {
            "lfd:profile": profile.name,
            "lfd:profile-hash": profile.hash,
            "lfd:views": str(len(pictures)),
            "lfd:technique": choices.technique,
            "lfd:preset": choices.preset,
            "lfd:seed": str(choices.seed),
        }
        files = _write(folder, pictures, text)

    if json:
        print_json(
            {
                "output": [str(file) for file in files],
                "display": profile.name,
                "technique": choices.technique,
                "preset": choices.preset,
                "views": len(files),
                "view_size": [pictures.shape[2], pictures.shape[1]],
                "seed": choices.seed,
                "camera": window.to_json_dict(),
                "warnings": [*display_warnings(profile), *said],
                "timings_ms": watch.finish(),
            }
        )
    say(f"{folder}: {len(files)} views of {pictures.shape[2]} × {pictures.shape[1]}")


def _write(folder: Path, pictures: NDArray[np.uint8], text: dict[str, str]) -> list[Path]:
    """Write uint8 [view, y, x, 3] as view_000.png and so on, with text; the files in view order.

    All appear or none, in the place of all views of an earlier run.
    """
    from lfd_render.panel.picture import write_png  # noqa: PLC0415 (keeps --help quick)

    names = [f"view_{index:03d}.png" for index in range(len(pictures))]
    with filling(folder) as temporary:
        for index, (name, pixels) in enumerate(zip(names, pictures, strict=True)):
            write_png(temporary / name, pixels, text | {"lfd:view": str(index)})
    files = [folder / name for name in names]
    remove_others(folder, files)
    return files

"""`lfd-render demo`: a panel image, and what three eyes before the display see of it."""

from __future__ import annotations

from typing import Annotated

import typer

from lfd_render.cli import options
from lfd_render.cli.bundle import LIGHT, with_choices
from lfd_render.cli.console import progress, say
from lfd_render.cli.inputs import load_display, load_scene, warn_of_light
from lfd_render.cli.outputs import check_folder_output, make_folder
from lfd_render.engine.choices import Choices

SCENE = "builtin:gallery?triangles=300000"
# Where the eyes are, in cones from the middle.
EYES = {"left": -0.375, "centre": 0.0, "right": 0.375}


@with_choices(*LIGHT)
def demo(
    output: Annotated[str, typer.Argument(metavar="FOLDER", help="Where the pictures go.")] = "out",
    *,
    scene: Annotated[str, typer.Option(help="Scene to show.")] = SCENE,
    display: options.DisplayOption = options.DEFAULT_DISPLAY,
    choices: Choices,
    device: options.DeviceOption = "auto",
) -> None:
    """Render a scene and look at it from the left, the centre and the right."""
    options.check_device(device)
    folder = check_folder_output(output)
    profile = load_display(display)
    with progress("Loading"):
        loaded = load_scene(scene)
        window = choices.window(loaded, profile)
        warn_of_light(loaded, choices)

    from lfd_render.panel.look import look  # noqa: PLC0415 (keeps --help quick)
    from lfd_render.panel.picture import side_by_side, write_png  # noqa: PLC0415
    from lfd_render.renderer import Renderer  # noqa: PLC0415

    with progress("Rendering"), Renderer(device=device) as renderer:
        eia = renderer.render(loaded, profile, window, **choices.options())
    with progress("Looking"):
        seen = {eye: look(eia.pixels, profile, at * profile.cone_rad) for eye, at in EYES.items()}

    make_folder(folder)
    eia.save(folder / "eia.png")
    for eye, picture in seen.items():
        write_png(folder / f"{eye}.png", picture)
    write_png(folder / "preview.png", side_by_side(list(seen.values())))
    height, width = eia.pixels.shape[:2]
    say(f"{folder}/eia.png: the panel image, {width} × {height}, on {eia.report['renderer']}")
    say(f"{folder}/preview.png: seen from the left, centre and right of the display")

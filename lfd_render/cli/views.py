"""`lfd-render views`: the single upright views of a scene."""

from __future__ import annotations

import itertools
import math
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
from lfd_render.errors import UsageError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from lfd_render.display import DisplayProfile


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
    camera_rows: Annotated[
        int | None,
        typer.Option(
            min=1,
            metavar="N",
            help="Of an array of cameras: view_r00_c000.png is the top leftmost.",
        ),
    ] = None,
    vertical_cone: Annotated[
        float | None,
        typer.Option(metavar="DEG", help="That rows of cameras span; else the display's cone."),
    ] = None,
    choices: Choices,
    device: options.DeviceOption = "auto",
    json: options.JsonOption = False,
) -> None:
    """Write the single upright views of SCENE, view_000.png leftmost, or those of an array of
    cameras, rows of them.
    """
    options.check_device(device)
    if vertical_cone is not None and camera_rows is None:
        raise UsageError("--vertical-cone: is for rows of cameras; give --camera-rows, too")
    folder = check_folder_output(output)

    watch = Stopwatch()
    with watch.span("load"), progress("Loading"):
        profile = load_display(display)
        loaded = load_scene(scene)
        window = choices.window(loaded, profile)
        warn_of_light(loaded, choices)
        heights_mm = _heights_mm(profile, camera_rows, vertical_cone)

    from lfd_render.renderer import Renderer  # noqa: PLC0415 (keeps --help quick)

    with watch.span("render"), progress("Rendering"), Renderer(device=device) as renderer:
        pictures = renderer.views(
            loaded, profile, window, heights_mm=heights_mm, **choices.options()
        )
        said = renderer.warnings
    for warning in said:
        if warning not in loaded.warnings:  # those were said when it was loaded
            warn(f"{scene}: {warning}")
    with watch.span("encode"), progress("Writing"):
        text = {
            "lfd:profile": profile.name,
            "lfd:profile-hash": profile.hash,
            "lfd:views": str(pictures.shape[-4]),
            "lfd:technique": choices.technique,
            "lfd:preset": choices.preset,
            "lfd:seed": str(choices.seed),
        }
        files = _write(folder, pictures, text, heights_mm)

    if json:
        print_json(
            {
                "output": [str(file) for file in files],
                "display": profile.name,
                "technique": choices.technique,
                "preset": choices.preset,
                "views": pictures.shape[-4],
                "heights_mm": heights_mm,
                "view_size": [pictures.shape[-2], pictures.shape[-3]],
                "seed": choices.seed,
                "camera": window.to_json_dict(),
                "warnings": [*display_warnings(profile), *said],
                "timings_ms": watch.finish(),
            }
        )
    many = f"{camera_rows} × {pictures.shape[-4]}" if camera_rows else str(len(files))
    say(f"{folder}: {many} views of {pictures.shape[-2]} × {pictures.shape[-3]}")


def _heights_mm(
    profile: DisplayProfile, rows: int | None, cone_deg: float | None
) -> list[float] | None:
    """Of each row of cameras, the highest first; None where there is no array."""
    from lfd_render.display import eye_heights_mm  # noqa: PLC0415 (keeps --help quick)

    if rows is None:
        return None
    cone_rad = profile.cone_rad if cone_deg is None else math.radians(cone_deg)
    return list(map(float, eye_heights_mm(profile, rows, cone_rad)))


def _write(
    folder: Path,
    pictures: NDArray[np.uint8],
    text: dict[str, str],
    heights_mm: list[float] | None,
) -> list[Path]:
    """Write uint8 [view, y, x, 3] as view_000.png and so on, or [row, view, y, x, 3] of rows of
    cameras at these heights as view_r00_c000.png, with text; the files in that order.

    All appear or none, in the place of all views of an earlier run.
    """
    from lfd_render.panel.picture import write_png  # noqa: PLC0415 (keeps --help quick)

    names: dict[str, tuple[int, ...]] = {}
    for index in itertools.product(*map(range, pictures.shape[:-3])):
        place = f"{index[0]:03d}" if len(index) == 1 else f"r{index[0]:02d}_c{index[1]:03d}"
        names[f"view_{place}.png"] = index
    with filling(folder) as temporary:
        for name, index in names.items():
            about = {"lfd:view": str(index[-1])}
            if heights_mm is not None:
                about |= {"lfd:row": str(index[0]), "lfd:height-mm": repr(heights_mm[index[0]])}
            write_png(temporary / name, pictures[index], text | about)
    files = [folder / name for name in names]
    remove_others(folder, files)
    return files

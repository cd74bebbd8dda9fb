"""`lfd-render weave`: a quilt, or unwoven views, become the panel image of a display."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lfd_render.cli import options
from lfd_render.cli.console import Stopwatch, print_json, progress, say, warn
from lfd_render.cli.inputs import display_warnings, load_display
from lfd_render.cli.outputs import check_picture_output, write_picture
from lfd_render.engine.texts import parse_size
from lfd_render.errors import UsageError

if TYPE_CHECKING:
    from lfd_render.display import DisplayProfile
    from lfd_render.panel.quilt import Quilt
    from lfd_render.panel.unweave import Unwoven


def weave(
    quilt: Annotated[
        str,
        typer.Argument(
            metavar="QUILT", help="A quilt, as NAME_qs8x6a0.75.png, or a folder of unwoven views."
        ),
    ],
    *,
    output: Annotated[
        str,
        typer.Option(
            "--output", "-o", metavar="FILE", help=".png, .exr or .raw to write; - for stdout."
        ),
    ],
    format: options.FormatOption = None,
    display: options.DisplayOption = options.DEFAULT_DISPLAY,
    tiles: options.TilesOption = None,
    lookup: options.LookupOption = options.Lookup.LENS,
    weave: options.WeavingOption = options.Weaving.NEAREST,
    aa: options.FilterOption = options.Filter.NONE,
    aa_light: options.FilterLightOption = options.FilterLight.LINEAR,
    device: options.DeviceOption = "auto",
    json: options.JsonOption = False,
) -> None:
    """Weave a QUILT into the panel image (EIA) of a display."""
    tiling = parse_size("tiles", tiles, "8x6")
    options.check_device(device)
    kind = check_picture_output(output, json, list(options.Format), format)

    watch = Stopwatch()
    with watch.span("load"), progress("Loading"):
        profile = load_display(display)
        views, warnings = _read(quilt, profile, tiling)
    for warning in warnings:
        warn(warning)

    from lfd_render.renderer import Renderer  # noqa: PLC0415 (keeps --help quick)

    with progress("Weaving"), Renderer(device=device) as renderer:
        eia = renderer.weave(
            views,
            profile,
            lookup=lookup.value,
            weave=weave.value,
            aa=(aa or options.Filter.NONE).value,
            aa_light=aa_light.value,
        )
    with watch.span("encode"), progress("Writing"):
        write_picture(output, lambda file: eia.save(file, kind))

    load_ms, encode_ms = watch.timings_ms["load"], watch.timings_ms["encode"]
    watch.timings_ms = {"load": load_ms, **eia.report["timings_ms"], "encode": encode_ms}
    if json:
        result = {"output": output, "display": profile.name} | eia.report
        all_warnings = [*display_warnings(profile), *warnings]
        print_json(result | {"warnings": all_warnings, "timings_ms": watch.finish()})
    height, width = eia.pixels.shape[:2]
    say(f"{output}: {width} × {height}, {eia.report['views']} views woven")


def _read(
    source: str, profile: DisplayProfile, tiles: tuple[int, int] | None
) -> tuple[Quilt | Unwoven, list[str]]:
    """Views of a quilt or of a folder, and what a person should know of them."""
    from lfd_render.panel.quilt import Quilt  # noqa: PLC0415 (keeps --help quick)
    from lfd_render.panel.view_folder import read_views  # noqa: PLC0415

    if Path(source).is_dir():
        if tiles:
            raise UsageError("--tiles: a folder of views has none; leave it out")
        return read_views(source, profile), []
    quilt = Quilt.load(source, tiles)
    return quilt, [*quilt.warnings, *quilt.misfits(profile, source)]

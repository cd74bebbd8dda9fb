"""`lfd-render display list`, `show`, `validate` and `convert`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lfd_render.cli import options
from lfd_render.cli.console import print_json, print_text, say, warn
from lfd_render.cli.inputs import load_display
from lfd_render.cli.outputs import check_picture_output, write_picture
from lfd_render.engine.texts import parse_views
from lfd_render.errors import LfdError, OutputError, ProfileError, UsageError

if TYPE_CHECKING:
    from lfd_render.display import DisplayProfile

DisplayArgument = Annotated[
    str, typer.Argument(metavar="DISPLAY", help="A shipped name, a file, or auto.")
]
SearchOption = Annotated[
    list[str] | None,
    typer.Option(metavar="FOLDER", help="Where drives are mounted; may be given again."),
]


def list_displays(*, search: SearchOption = None, json: options.JsonOption = False) -> None:
    """The shipped profiles, and the displays whose calibration drive is mounted."""
    from lfd_render.display import DisplayProfile, shipped_profiles  # noqa: PLC0415
    from lfd_render.display.mounted import mounted_calibrations  # noqa: PLC0415

    roots = None if search is None else [Path(folder) for folder in search]
    entries: list[dict[str, Any]] = []
    sources = [(name, "shipped") for name in shipped_profiles()]
    sources += [(str(path), "mounted") for path in mounted_calibrations(roots)]
    for source, kind in sources:
        entry: dict[str, Any] = {"display": source, "kind": kind}
        try:
            profile = DisplayProfile.load(source)
        except ProfileError as error:
            warn(str(error))
            entry["error"] = str(error)
        else:
            entry |= {
                "name": profile.name,
                "template": profile.template,
                "resolution_px": list(profile.resolution_px),
                "lens_count": profile.lens_count,
                "views": profile.views,
            }
        entries.append(entry)
    if json:
        print_json({"displays": entries})
        return
    print_text("\n".join(map(_listed, entries)))


def _listed(entry: dict[str, Any]) -> str:
    if "error" in entry:
        return f"{entry['display']}  cannot be read"
    width, height = entry["resolution_px"]
    what = "template" if entry["template"] else "calibration"
    return (
        f"{entry['display']}  {width} x {height}, {entry['lens_count']:.2f} lenses, "
        f"{entry['views']} views, {what}" + (", mounted" if entry["kind"] == "mounted" else "")
    )


def show(
    display: DisplayArgument,
    *,
    picture: Annotated[
        str | None,
        typer.Option(metavar="FILE", help="PNG of a patch's views and of the eyes; - for stdout."),
    ] = None,
    views: options.ViewsOption = None,
    json: options.JsonOption = False,
) -> None:
    """A display's figures, and what follows from them."""
    count = parse_views(views)
    if count == "continuous":
        raise UsageError("--views: continuous; give a number")
    if picture is not None:
        check_picture_output(picture, json)
    profile = load_display(display)
    figures = _figures(profile)
    if picture is not None:
        from lfd_render.panel.layout import layout_picture  # noqa: PLC0415
        from lfd_render.panel.picture import write_png  # noqa: PLC0415

        pixels = layout_picture(profile, count)
        write_picture(picture, lambda file: write_png(file, pixels))
    if json:
        print_json({"display": profile.name, "picture": picture, **figures})
    elif picture is None:
        print_text("\n".join(f"{name:24} {_worded(value)}" for name, value in figures.items()))


def _worded(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.10g}"
    if isinstance(value, list):
        return " x ".join(map(_worded, value))
    return "not known" if value is None else str(value)


def _figures(profile: DisplayProfile) -> dict[str, Any]:
    """What `show` says, by name."""
    width, height = profile.resolution_px
    lean = "not at all" if profile.drift == 0 else "left" if profile.drift > 0 else "right"
    return {
        "name": profile.name,
        "serial": profile.serial,
        "date": profile.date,
        "hash": profile.hash,
        "template": profile.template,
        "source": profile.provenance.source,
        "assumed": ", ".join(profile.provenance.assumed) or "nothing",
        "resolution_px": [width, height],
        "size_mm": list(profile.size_mm),
        "subpixels": _subpixels(profile),
        "lens_count": profile.lens_count,
        "physical_lens_count": profile.physical_lens_count,
        "pitch_mm": profile.pitch_mm,
        "gap_mm": profile.lens.gap_mm,
        "index": profile.index,
        "drift": profile.drift,
        "tilt_deg": math.degrees(profile.tilt_rad),
        "lens_leans_going_up": lean,
        "center": profile.center,
        "subpixels_per_lens": 3 * width / profile.lens_count,
        "views_per_subpixel": profile.views * profile.lens_count / (3 * width),
        "views_per_row": profile.views * profile.lens_count * profile.drift / height,
        "views": profile.views,
        "inverted": profile.viewing.inverted,
        "cone_deg": profile.viewing.cone_deg,
        "distance_mm": profile.distance_mm,
        "spacing": profile.spacing,
        "corrected": profile.correction is not None,
    }


def _subpixels(profile: DisplayProfile) -> str:
    subpixels = profile.panel.subpixels
    if subpixels.layout == "cells":
        return f"cells, pattern mode {subpixels.pattern_mode}"
    return f"stripes {subpixels.order} {subpixels.axis}, {subpixels.origin}"


def validate(
    displays: Annotated[list[str], typer.Argument(metavar="DISPLAY…", help="Names or files.")],
    *,
    json: options.JsonOption = False,
) -> None:
    """Check profiles: what is wrong, and what is hardly meant."""
    from lfd_render.display import DisplayProfile  # noqa: PLC0415 (keeps --help quick)
    from lfd_render.display.plausible import doubts  # noqa: PLC0415

    results: list[dict[str, Any]] = []
    failed: LfdError | None = None
    for source in displays:
        try:
            profile = DisplayProfile.load(source)
        except ProfileError as error:
            results.append({"display": source, "valid": False, "error": str(error)})
            if failed is not None and not json:
                say(str(failed))
            failed = error
            continue
        found = doubts(profile)
        for doubt in found:
            warn(f"{source}: {doubt}")
        results.append({"display": source, "valid": True, "hash": profile.hash, "warnings": found})
        if not json:
            print_text(f"{source}: valid, {profile.hash}")
    if json:
        print_json({"displays": results})
    if failed is not None:
        raise failed


def convert(
    display: DisplayArgument,
    *,
    to: Annotated[
        str,
        typer.Option(
            metavar="FORMAT",
            help="profile, looking-glass, 3d-global, van-berkel, physical or leia.",
        ),
    ],
    output: Annotated[
        str, typer.Option("--output", "-o", metavar="FILE", help="The file; - for stdout.")
    ] = "-",
    json: options.JsonOption = False,
) -> None:
    """Tell a display in another system's format, and say what that cannot hold."""
    from lfd_render.display.convert import convert as converted  # noqa: PLC0415
    from lfd_render.display.convert import views_apart  # noqa: PLC0415
    from lfd_render.display.files import replacing  # noqa: PLC0415

    if output == "-" and json:
        raise UsageError("-o -: stdout carries either the file or --json's object; give a file")
    if output != "-" and Path(output).is_dir():
        raise OutputError(f"{output}: is a folder; give a file name")
    profile = load_display(display)
    conversion = converted(profile, to)
    apart = views_apart(profile, conversion.read_back)
    if output == "-":
        print_text(conversion.text.rstrip("\n"))
    else:
        with replacing(Path(output)) as temporary:
            temporary.write_text(conversion.text, encoding="utf-8")
    if json:
        lost = [vars(difference) for difference in conversion.lost]
        print_json({"output": output, "display": profile.name, "format": to, "lost": lost,
                    "views_apart": apart})  # fmt: skip
    for difference in conversion.lost:
        was, became = (repr(value)[:80] for value in (difference.was, difference.became))
        say(f"{to} cannot hold {difference.field}: {was} comes back as {became}")
    if apart is None or apart > 1e-6:
        by = "in its pixels" if apart is None else f"by up to {apart:.3g} views"
        warn(f"{to}: the picture of what comes back differs {by}")

"""`lfd-render unweave`: the views that a panel image shows, and what a wrong profile would cost."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from lfd_render.cli import options
from lfd_render.cli.console import Stopwatch, print_json, progress, say, warn
from lfd_render.cli.inputs import display_warnings, load_display, load_eia
from lfd_render.cli.outputs import (
    check_folder_output,
    check_picture_output,
    filling,
    remove_others,
    write_picture,
)
from lfd_render.errors import UsageError

if TYPE_CHECKING:
    from pathlib import Path

    from lfd_render.display import DisplayProfile
    from lfd_render.panel.check import ViewErrors
    from lfd_render.panel.eia import EiaFile
    from lfd_render.panel.unweave import Unwoven


def unweave(
    eia: Annotated[str, typer.Argument(metavar="EIA", help="Panel image of the display.")],
    *,
    output: Annotated[
        str | None,
        typer.Option(
            "--output", "-o", metavar="FOLDER", help="Folder for view_000.png (leftmost) and on."
        ),
    ] = None,
    display: options.DisplayOption = options.DEFAULT_DISPLAY,
    views: Annotated[
        int | None, typer.Option(min=1, help="Number of views woven in; else as the file says.")
    ] = None,
    rows: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="Rows of a view; else as the file says, or as many as weave back exactly.",
        ),
    ] = None,
    check_display: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|FILE", help="Report by how many views this wrong profile would be off."
        ),
    ] = None,
    error_picture: Annotated[
        str | None,
        typer.Option(metavar="FILE", help="With --check-display: PNG of that error; - for stdout."),
    ] = None,
    json: options.JsonOption = False,
) -> None:
    """Recover the views of a panel image; 'weave FOLDER' gives the image back, bit for bit."""
    if output is None and check_display is None:
        raise UsageError("-o: missing; give a folder for the views, or --check-display")
    if error_picture is not None and check_display is None:
        raise UsageError("--error-picture: shows the error of another profile; add --check-display")
    folder = check_folder_output(output) if output is not None else None
    if error_picture is not None:
        check_picture_output(error_picture, json)

    watch = Stopwatch()
    with watch.span("load"), progress("Loading"):
        profile = load_display(display)
        other = load_display(check_display) if check_display else None
        panel = load_eia(eia, profile)
    count = views or panel.views or profile.views
    result: dict[str, Any] = {"output": None, "display": profile.name, "views": count}
    warnings = [*display_warnings(profile), *panel.warnings]

    if folder is not None:
        with watch.span("unweave"), progress("Unweaving"):
            unwoven = _unwoven(panel, profile, count, rows)
        if unwoven.collisions:
            warnings.append(
                f"{eia}: {unwoven.collisions} subpixels share a view pixel with another colour; "
                "the views do not weave back exactly, give more --views or leave --rows out"
            )
            warn(warnings[-1])
        with watch.span("encode"), progress("Writing"):
            files = _write(folder, unwoven, profile)
        result |= {
            "output": [str(file) for file in files],
            "view_size": [unwoven.grid.columns, unwoven.grid.rows],
            "sampled": round(unwoven.sampled, 6),
            "collisions": unwoven.collisions,
        }
        say(
            f"{folder}: {count} views of {unwoven.grid.columns} × {unwoven.grid.rows}, "
            f"{100 * unwoven.sampled:.1f} % of them in the panel image, the rest filled in"
        )
    if other is not None:
        with watch.span("check"), progress("Comparing"):
            errors = _errors(profile, other, count)
        result["check"] = {"display": other.name, "error_picture": error_picture}
        result["check"] |= errors.to_json_dict()
        if error_picture is not None:
            _write_error(error_picture, errors)
        say(_described(errors, other.name))
    if json:
        print_json(result | {"warnings": warnings, "timings_ms": watch.finish()})


def _unwoven(panel: EiaFile, profile: DisplayProfile, views: int, rows: int | None) -> Unwoven:
    """Views of as many rows as asked for, else as the file says if that weaves back exactly."""
    from lfd_render.panel.unweave import unweave as unwoven  # noqa: PLC0415 (keeps --help quick)

    known = panel.lens_rows
    if rows is None and known is not None and known <= profile.resolution_px[1]:
        found = unwoven(panel.pixels, profile, views, known)
        if not found.collisions:
            return found
    return unwoven(panel.pixels, profile, views, rows)


def _write(folder: Path, unwoven: Unwoven, profile: DisplayProfile) -> list[Path]:
    """All files appear or none, in the place of all views of an earlier run."""
    from lfd_render.panel.view_folder import view_name, write_views  # noqa: PLC0415

    with filling(folder) as temporary:
        write_views(temporary, unwoven, profile)
    files = [folder / view_name(index) for index in range(len(unwoven.views))]
    remove_others(folder, [*files, folder / "views.json"])
    return files


def _errors(profile: DisplayProfile, other: DisplayProfile, views: int) -> ViewErrors:
    from lfd_render.panel.check import view_errors  # noqa: PLC0415 (keeps --help quick)

    return view_errors(profile, other, views)


def _write_error(path: str, errors: ViewErrors) -> None:
    from lfd_render.panel.picture import write_png  # noqa: PLC0415 (keeps --help quick)

    picture = errors.picture()
    write_picture(path, lambda file: write_png(file, picture))


def _described(errors: ViewErrors, name: str) -> str:
    corners = ", ".join(
        f"{place.replace('_', ' ')} {value:+.2f}" for place, value in errors.corners.items()
    )
    across, up = errors.fringes
    return (
        f"'{name}' would be off by {errors.rms:.2f} views rms, {errors.largest:.2f} at most, "
        f"{errors.mean:+.2f} on average; {corners}; {abs(across):.2f} fringes across and "
        f"{abs(up):.2f} up the panel"
    )

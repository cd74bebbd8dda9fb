"""`lfd-render display fit`: photographs of patterns become a profile with error bars."""

from __future__ import annotations

import functools
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lfd_render.cli import options
from lfd_render.cli.console import Stopwatch, print_json, progress, say, warn
from lfd_render.cli.outputs import check_picture_output, write_picture
from lfd_render.errors import PictureError, UsageError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from lfd_render.display.calibration import Corners, Fit, PhotoSet

SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".webp", ".bmp")
SETTLED_FRINGES = 0.25
_PICTURE_PX = 960


def fit(
    photos: Annotated[
        list[str],
        typer.Argument(
            metavar="FOLDER...",
            help="Photographs, named as the patterns of 'pattern phases'; a second folder from "
            "another distance tells the gap.",
        ),
    ],
    *,
    output: Annotated[
        str, typer.Option("--output", "-o", metavar="FILE", help=".json to write; - for stdout.")
    ],
    display: Annotated[
        str,
        typer.Option("--display", metavar="NAME|FILE", help="Profile the patterns were made for."),
    ],
    corners: Annotated[
        list[str] | None,
        typer.Option(
            metavar="X,Y X,Y X,Y X,Y",
            help="The panel in the photographs, clockwise from top left, once a folder; else "
            "found in the photograph 'white'.",
        ),
    ] = None,
    distance: Annotated[
        list[float] | None,
        typer.Option(metavar="MM", help="Camera to panel, once a folder; the viewing distance."),
    ] = None,
    camera_offset: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y", help="mm of the camera right of and above the panel's middle; 0,0."
        ),
    ] = None,
    residual: Annotated[
        str | None, typer.Option(metavar="FILE", help="PNG of what the fit leaves, in views.")
    ] = None,
    correction: Annotated[
        bool,
        typer.Option(
            "--correction", help="Make what the fit leaves, smoothed, the profile's correction."
        ),
    ] = False,
    name: Annotated[str | None, typer.Option(help="Name of the profile.")] = None,
    json: options.JsonOption = False,
) -> None:
    """Fit a profile to photographs of test patterns in each FOLDER."""
    check_picture_output(output, json, ["json"])
    if residual is not None:
        check_picture_output(residual, json or output == "-")
    _check_counts(photos, {"--corners": corners, "--distance": distance})
    if len(photos) == 2 and not distance:
        raise UsageError("--distance: missing; two folders need the camera's distance of each")
    offset = _pair("--camera-offset", camera_offset) if camera_offset else (0.0, 0.0)

    from lfd_render.display import DisplayProfile  # noqa: PLC0415 (keeps --help quick)
    from lfd_render.display.calibration import fit as fitted  # noqa: PLC0415

    watch = Stopwatch()
    guess = DisplayProfile.load(display)
    sets = [
        _photo_set(
            Path(folder),
            _parse_corners(corners[index]) if corners else None,
            distance[index] if distance else None,
            offset,
        )
        for index, folder in enumerate(photos)
    ]
    with watch.span("fit"), progress("Fitting"):
        found = fitted(sets, guess, name, correction=correction)
    write_picture(output, found.profile.save)
    if residual is not None:
        _write_residual(residual, found)
    warnings = _warnings(found)
    for warning in warnings:
        warn(warning)
    _say(found, output)
    if json:
        result = {"output": output, "display": found.profile.name, "residual": residual}
        print_json(result | found.report | {"warnings": warnings, "timings_ms": watch.finish()})


def _check_counts(photos: list[str], given: dict[str, list[str] | list[float] | None]) -> None:
    if len(photos) > 2:
        raise UsageError(f"FOLDER: {len(photos)} folders; give one, or two from two distances")
    for option, values in given.items():
        if values and len(values) != len(photos):
            raise UsageError(
                f"{option}: given {len(values)} times for {len(photos)} folders; give it once each"
            )


def _photo_set(
    folder: Path,
    corners: Corners | None,
    distance: float | None,
    offset: tuple[float, float],
) -> PhotoSet:
    """The photographs of a folder by their names. Raises PictureError, UsageError."""
    from lfd_render.display.calibration import PhotoSet  # noqa: PLC0415 (keeps --help quick)
    from lfd_render.display.patterns import Step  # noqa: PLC0415
    from lfd_render.panel.picture import read_photograph  # noqa: PLC0415

    if not folder.is_dir():
        raise PictureError(f"{folder}: is no folder; give the folder of the photographs")
    shots, white = [], None
    seen: dict[str, str] = {}
    for file in sorted(folder.iterdir()):
        if file.name.startswith(".") or file.suffix.lower() not in SUFFIXES:
            continue
        step = Step.named(file.stem)
        if step is None and file.stem != "white":
            warn(f"{file}: is named as no pattern and left out")
            continue
        if file.stem in seen:
            raise PictureError(f"{file}: is there as {seen[file.stem]} too; keep one of them")
        seen[file.stem] = file.name
        read = functools.partial(read_photograph, file)
        if step is None:
            white = (str(file), read)
        else:
            shots.append((step, str(file), read))
    return PhotoSet(str(folder), shots, white, corners, distance, offset)


def _parse_corners(text: str) -> Corners:
    from lfd_render.display.calibration import given_corners  # noqa: PLC0415 (keeps --help quick)

    return given_corners([_pair("--corners", point) for point in text.split()])


def _pair(option: str, text: str) -> tuple[float, float]:
    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError as cause:
        raise UsageError(f"{option}: '{text}'; give two numbers as 12.5,-3") from cause
    if not (math.isfinite(x) and math.isfinite(y)):
        raise UsageError(f"{option}: '{text}'; give two finite numbers")
    return x, y


def _write_residual(path: str, found: Fit) -> None:
    """The blocks' phases as a picture of the panel, in the colours of `unweave`'s error picture."""
    import numpy as np  # noqa: PLC0415 (keeps --help quick)

    from lfd_render.panel.check import ViewErrors  # noqa: PLC0415
    from lfd_render.panel.picture import write_png  # noqa: PLC0415

    blocks: NDArray[np.float64] = np.nan_to_num(found.residual_views)
    rows, columns = blocks.shape
    scale = max(1, _PICTURE_PX // max(rows, columns))
    error = blocks.repeat(scale, axis=0).repeat(scale, axis=1)
    largest = float(np.abs(blocks).max())
    errors = ViewErrors(
        error, float(blocks.mean()), float(np.sqrt((blocks**2).mean())), largest,
        float((np.abs(blocks) > 0.5).mean()), {}, 0.0, (0.0, 0.0),
    )  # fmt: skip
    picture = errors.picture()
    write_picture(path, lambda file: write_png(file, picture))


def _warnings(found: Fit) -> list[str]:
    a, b = found.report["fringes"]
    largest = max(abs(a), abs(b))
    if largest <= SETTLED_FRINGES:
        return []
    return [
        f"the guess was {largest:.2f} fringes off; fit again from patterns of this profile, so "
        "that corners and the camera's distortion count for less"
    ]


def _say(found: Fit, output: str) -> None:
    doubts, report, profile = found.doubts, found.report, found.profile
    width, height = profile.size_mm
    slope = width / height * doubts["drift"] * math.cos(profile.tilt_rad) ** 2
    views = profile.views
    say(
        f"{output}: {report['lens_count']:.4f} ± {doubts['lens_count']:.4f} lenses, tilt "
        f"{report['tilt_deg']:.4f} ± {math.degrees(slope):.4f}°, center {report['center']:.5f} ± "
        f"{doubts['center']:.5f}; phases left: {report['residual_rms_views']:.2f} of {views} views "
        "rms"
    )
    if "gap_mm" in doubts:
        say(f"gap {report['gap_mm']:.3f} ± {doubts['gap_mm']:.3f} mm")
    for colour, sigma in report["sigma_views"].items():
        doubt = doubts[f"sigma_views.{colour}"]
        say(f"{colour}: crosstalk {sigma:.2f} ± {doubt:.2f} views")

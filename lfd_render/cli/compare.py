"""`lfd-render compare`: how close pictures are to their references."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lfd_render.cli import options
from lfd_render.cli.console import print_json, print_text, progress, say
from lfd_render.cli.inputs import load_display
from lfd_render.cli.outputs import check_folder_output, check_picture_output, filling, write_picture
from lfd_render.errors import PictureError, UsageError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Pixels = NDArray[np.uint8]

_KINDS = (".png", ".exr", ".jpg", ".jpeg", ".webp", ".tif", ".tiff", ".bmp")
_UNITS = {"psnr": " dB", "cvvdp": " JOD"}


class Metric(StrEnum):
    """What is measured; the first four of each frame, their mean given."""

    RMSE = "rmse"
    PSNR = "psnr"
    SSIM = "ssim"
    FLIP = "flip"
    CVVDP = "cvvdp"


class Shown(StrEnum):
    """What a difference picture shows."""

    LEVELS = "levels"
    FLIP = "flip"


def compare(
    reference: Annotated[
        str, typer.Argument(metavar="A", help="Picture, or folder of frames, that is right.")
    ],
    test: Annotated[str, typer.Argument(metavar="B", help="The one to compare with it.")],
    *,
    metric: Annotated[
        list[Metric] | None,
        typer.Option(help="Measure this; give it again for more. By default all but cvvdp."),
    ] = None,
    difference: Annotated[
        str | None,
        typer.Option(
            metavar="FILE|FOLDER", help="PNG of where they differ; of frames, a folder of them."
        ),
    ] = None,
    show: Annotated[
        Shown,
        typer.Option(help="levels: absolute differences, the largest white; flip: FLIP's map."),
    ] = Shown.LEVELS,
    display: options.DisplayOption = options.DEFAULT_DISPLAY,
    pixels_per_degree: Annotated[
        float | None,
        typer.Option(
            metavar="N",
            help="What flip and cvvdp see; else as wide as the display, from its distance.",
        ),
    ] = None,
    fps: Annotated[float, typer.Option(metavar="N", help="Frames a second, for cvvdp.")] = 30.0,
    json: options.JsonOption = False,
) -> None:
    """Measure how close B is to A: pictures, or folders of frames of the same names.

    An EXR is compared as the picture that it would be shown as.
    """
    if pixels_per_degree is not None and not 0 < pixels_per_degree < math.inf:
        raise UsageError(f"--pixels-per-degree: {pixels_per_degree}; give a number above 0")
    if not 0 < fps < math.inf:
        raise UsageError(f"--fps: {fps}; give a number above 0")
    pairs = _pairs(Path(reference), Path(test))
    folder = None
    if difference is not None and Path(reference).is_dir():
        folder = check_folder_output(difference)
    elif difference is not None:
        check_picture_output(difference, json)
    metrics = metric or [kind for kind in Metric if kind != Metric.CVVDP]

    with progress("Comparing"):
        frames = [(_read(a), _read(b)) for a, b in pairs]
        width = frames[0][0].shape[1]
        ppd = pixels_per_degree or _pixels_per_degree(display, width)
        values = {kind.value: _measure(kind, frames, pairs, ppd, fps) for kind in metrics}
        white = _largest(frames)
        if difference is not None:
            pictures = [_difference(show, a, b, white, ppd) for a, b in frames]
            _write(difference, folder, pairs, pictures)

    if json:
        result: dict[str, Any] = {
            "reference": reference,
            "test": test,
            "frames": len(frames),
            "size": list(frames[0][0].shape[1::-1]),
            "pixels_per_degree": round(ppd, 3),
            # JSON has no infinity: equal pictures have no error to tell in dB.
            **{k: v if math.isfinite(v) else None for k, v in values.items()},
            "largest_difference": white,
        }
        print_json(result | ({"difference": difference} if difference else {}))
    else:
        lines = [f"{name:6} {value:.6g}{_UNITS.get(name, '')}" for name, value in values.items()]
        print_text("\n".join(lines))
    what = f"{len(frames)} frames" if len(frames) > 1 else "a picture"
    said = f"{reference}, {test}: {what} of {width} × {frames[0][0].shape[0]}"
    say(f"{said}, at most {white} levels apart")
    if difference is not None and show == Shown.LEVELS:
        say(f"{difference}: white is a difference of {white} levels")


def _pairs(reference: Path, test: Path) -> list[tuple[Path, Path]]:
    """Files to compare, in order. Raises PictureError where one of a pair is missing."""
    if reference.is_dir() != test.is_dir():
        folder, file = (reference, test) if reference.is_dir() else (test, reference)
        raise PictureError(f"{folder}: is a folder and {file} is none; give two of a kind")
    if not reference.is_dir():
        return [(reference, test)]
    names = [sorted(f.name for f in folder.iterdir() if f.suffix.lower() in _KINDS)
             for folder in (reference, test)]  # fmt: skip
    for folder, here in zip((reference, test), names, strict=True):
        if not here:
            raise PictureError(f"{folder}: holds no pictures; give a folder of numbered frames")
    for folder, other, here, there in (
        (test, reference, names[1], names[0]),
        (reference, test, names[0], names[1]),
    ):
        if missing := sorted(set(there) - set(here)):
            raise PictureError(
                f"{folder}: lacks {missing[0]}"
                + (f" and {len(missing) - 1} more" if len(missing) > 1 else "")
                + f", which {other} has; give folders of the same frames"
            )
    return [(reference / name, test / name) for name in names[0]]


def _read(path: Path) -> Pixels:
    """Pixels as they would be shown."""
    from lfd_render.panel.picture import read_picture  # noqa: PLC0415 (keeps --help quick)
    from lfd_render.reference.encode import encoded  # noqa: PLC0415
    from lfd_render.scene.environment import read_radiance  # noqa: PLC0415
    from lfd_render.scene.limits import LoadLimits  # noqa: PLC0415

    if path.suffix.lower() != ".exr":
        return read_picture(path)
    linear = read_radiance(path, LoadLimits())
    # Infinities become the largest number a half float holds; what is no number has no colour.
    if not (linear == linear).all():  # noqa: PLR0124 (NaN alone differs from itself)
        raise PictureError(f"{path}: has pixels that are no numbers; render it anew")
    return encoded(linear.clip(0.0, 65504.0))


def _pixels_per_degree(display: str, width: int) -> float:
    profile = load_display(display)
    return width / (2 * math.degrees(math.atan(0.5 * profile.size_mm[0] / profile.distance_mm)))


def _measure(
    metric: Metric,
    frames: list[tuple[Pixels, Pixels]],
    pairs: list[tuple[Path, Path]],
    ppd: float,
    fps: float,
) -> float:
    from lfd_render import quality  # noqa: PLC0415 (keeps --help quick)

    if metric == Metric.CVVDP:
        return quality.cvvdp([a for a, _ in frames], [b for _, b in frames], ppd, fps)
    measures: dict[Metric, Callable[[Pixels, Pixels], float]] = {
        Metric.RMSE: quality.rmse,
        Metric.PSNR: quality.psnr,
        Metric.SSIM: quality.ssim_luma,
        Metric.FLIP: lambda a, b: quality.flip(a, b, ppd),
    }
    found = []
    for (a, b), (first, second) in zip(frames, pairs, strict=True):
        try:
            found.append(measures[metric](a, b))
        except PictureError as error:
            raise PictureError(f"{first}, {second}: {error}") from error
    return statistics.fmean(found)


def _largest(frames: list[tuple[Pixels, Pixels]]) -> int:
    from lfd_render.quality import largest_difference  # noqa: PLC0415 (keeps --help quick)

    return max(largest_difference(a, b) for a, b in frames)


def _difference(show: Shown, a: Pixels, b: Pixels, white: int, ppd: float) -> Pixels:
    from lfd_render.quality import difference_picture, flip_picture  # noqa: PLC0415

    return flip_picture(a, b, ppd) if show == Shown.FLIP else difference_picture(a, b, white)


def _write(
    output: str, folder: Path | None, pairs: list[tuple[Path, Path]], pictures: list[Pixels]
) -> None:
    from lfd_render.panel.picture import write_png  # noqa: PLC0415 (keeps --help quick)

    if folder is None:
        write_picture(output, lambda file: write_png(file, pictures[0]))
        return
    with filling(folder) as temporary:
        for (first, _), picture in zip(pairs, pictures, strict=True):
            write_png(temporary / f"{first.stem}.png", picture)

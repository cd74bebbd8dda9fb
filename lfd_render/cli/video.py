"""`lfd-render video`: the frames of a sequence in one file."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from lfd_render.cli import options
from lfd_render.cli.console import Stopwatch, print_json, progress_bar, say
from lfd_render.cli.outputs import STDOUT, check_picture_output
from lfd_render.errors import UsageError


class Codec(StrEnum):
    """How frames are compressed."""

    FFV1 = "ffv1"
    H264 = "h264"
    HEVC = "hevc"


class Chroma(StrEnum):
    """What becomes of colours."""

    ALL = "444"
    HALVED = "420"


def video(
    folder: Annotated[str, typer.Argument(metavar="FOLDER", help="What 'animate' made.")],
    *,
    output: Annotated[
        str, typer.Option("--output", "-o", metavar="FILE", help=".mkv or .mp4 to write.")
    ],
    codec: Annotated[
        Codec | None, typer.Option(help="Else ffv1 in .mkv, h264 in .mp4.", show_default=False)
    ] = None,
    chroma: Annotated[
        Chroma,
        typer.Option(help="444: lossless RGB; 420: as players like it, not for panel images."),
    ] = Chroma.ALL,
    frames: Annotated[
        str | None, typer.Option(metavar="A:B", help="Frames A to B, both included; else all.")
    ] = None,
    json: options.JsonOption = False,
) -> None:
    """Encode the frames of FOLDER; what is lossless is checked by decoding it."""
    if output == STDOUT:
        raise UsageError("-o -: a video goes to a file; give its name")

    from lfd_render.engine.finished import FinishedSequence  # noqa: PLC0415 (keeps --help quick)
    from lfd_render.engine.sequence import parse_frames  # noqa: PLC0415
    from lfd_render.panel.video import CONTAINERS, chosen_encoding, write_video  # noqa: PLC0415

    check_picture_output(output, formats=[suffix[1:] for suffix in CONTAINERS])
    path = Path(output)
    sequence = FinishedSequence.load(folder, parse_frames(frames) if frames else None)
    encoding = chosen_encoding(path, codec, chroma, sequence.kind)
    watch, count = Stopwatch(), len(sequence.files)
    with watch.span("encode"), progress_bar("Encoding") as done:
        write_video(
            path, sequence.pictures(), sequence.fps, encoding, lambda made: done(made / count)
        )
    size = path.stat().st_size
    if json:
        result = {
            "output": output, "frames": count, "fps": sequence.fps, "encoder": encoding.encoder,
            "lossless": encoding.lossless, "bytes": size, "timings_ms": watch.finish(),
        }  # fmt: skip
        print_json(result)
    exact = ", each decoded to its frame's pixels" if encoding.lossless else ""
    say(f"{output}: {count} frames by {encoding.encoder}, {size / 1e6:.1f} MB{exact}")

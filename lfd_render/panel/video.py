"""Videos: lossless RGB, checked by decoding; 4:2:0 only where each pixel is of one view.

Y'CbCr of 8 bits cannot hold all RGB colours even at 4:4:4, so lossless means RGB planes here: FFV1,
H.264 High 4:4:4 Predictive, or HEVC RExt.
"""

from __future__ import annotations

import importlib.util
import zlib
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from lfd_render.display.files import replacing
from lfd_render.errors import OptionError, OutputError
from lfd_render.panel.picture import Pixels

CONTAINERS = {".mkv": "matroska", ".mp4": "mp4"}


@dataclass(frozen=True)
class Encoding:
    """An encoder of libavcodec, the pixels it takes, its options, and whether all bits survive."""

    encoder: str
    pixels: str
    options: dict[str, str]
    lossless: bool = True


_QUIET = "log-level=error"
_SRGB = "colorprim=bt709:transfer=iec61966-2-1:colormatrix=bt709"
ENCODINGS = {
    ("ffv1", "444"): Encoding("ffv1", "bgr0", {"level": "3", "slicecrc": "1"}),
    ("h264", "444"): Encoding("libx264rgb", "rgb24", {"qp": "0"}),
    ("hevc", "444"): Encoding("libx265", "gbrp", {"x265-params": f"lossless=1:{_QUIET}"}),
    ("h264", "420"): Encoding(
        "libx264", "yuv420p", {"crf": "16", "x264-params": _SRGB}, lossless=False
    ),
    ("hevc", "420"): Encoding(
        "libx265", "yuv420p", {"crf": "18", "x265-params": f"{_SRGB}:{_QUIET}"}, lossless=False
    ),
}


def chosen_encoding(path: Path, codec: str | None, chroma: str, kind: str) -> Encoding:
    """How a file of this name is encoded; codec None: FFV1 in .mkv, H.264 in .mp4. kind: eia, quilt
    or look. Raises OptionError for what does not go together."""
    suffix = path.suffix.lower()
    if suffix not in CONTAINERS:
        raise OptionError("output", f"'{path}': suffix '{path.suffix}'; give .mkv or .mp4")
    codec = codec or ("h264" if suffix == ".mp4" or chroma == "420" else "ffv1")
    if suffix == ".mp4" and codec == "ffv1":
        raise OptionError("codec", "ffv1 goes into .mkv; give h264 or hevc for .mp4")
    if chroma == "420" and kind == "eia":
        raise OptionError(
            "chroma",
            "420 averages the colours of 2 x 2 pixels, which in a panel image show different views "
            "and would mix; give 444, or make quilts or looks",
        )
    if (codec, chroma) not in ENCODINGS:
        raise OptionError("chroma", f"{codec} is lossless; leave it out, or give h264 or hevc")
    if importlib.util.find_spec("av") is None:
        raise OptionError("output", "videos need PyAV; pip install 'lfd-render[video]'")
    import av  # noqa: PLC0415 (an extra)

    encoding = ENCODINGS[codec, chroma]
    if encoding.encoder not in av.codecs_available:
        raise OptionError("codec", f"{codec}: this PyAV has no {encoding.encoder}; give ffv1")
    return encoding


def write_video(
    path: Path,
    pictures: Iterable[Pixels],
    fps: float,
    encoding: Encoding,
    progress: Callable[[int], None] = lambda _: None,
) -> None:
    """Write pictures of one size, uint8 [y, x, 3] each, as a video; the file appears whole or not
    at all, and a lossless one when it has decoded to the same pixels. progress is told the frames
    that were encoded. Raises OutputError."""
    import av  # noqa: PLC0415 (an extra)

    checksums = []

    def told() -> Iterator[Pixels]:
        for picture in pictures:
            checksums.append(_checksum(picture))
            yield picture
            progress(len(checksums))

    with replacing(path) as temporary:
        try:
            container = CONTAINERS[path.suffix.lower()]
            with av.open(str(temporary), "w", format=container) as output:
                _encode(output, told(), fps, encoding, path)
            if encoding.lossless:
                _check(temporary, checksums, path)
        except av.FFmpegError as error:
            raise OutputError(f"{path}: cannot be encoded: {error.strerror}") from error


def read_video(path: Path) -> Iterator[Pixels]:
    """The frames of a video, uint8 [y, x, 3] each."""
    import av  # noqa: PLC0415 (an extra)

    with av.open(str(path)) as video:
        for frame in video.decode(video=0):
            yield np.asarray(frame.to_ndarray(format="rgb24"), np.uint8)


def _encode(
    output: Any, pictures: Iterable[Pixels], fps: float, encoding: Encoding, path: Path
) -> None:
    import av  # noqa: PLC0415 (an extra)

    stream: Any = None
    size: tuple[int, int] = (0, 0)
    for picture in pictures:
        height, width, _ = picture.shape
        if stream is None:
            if not encoding.lossless and (width % 2 or height % 2):
                raise OptionError(
                    "chroma", f"420 takes even sizes, not {width} x {height}; give 444"
                )
            size = width, height
            rate = Fraction(fps).limit_denominator(1001)
            stream = output.add_stream(encoding.encoder, rate, options=encoding.options)
            stream.width, stream.height, stream.pix_fmt = width, height, encoding.pixels
            stream.codec_context.thread_count = 0  # as many as there are cores
        if (width, height) != size:
            raise OutputError(
                f"{path}: frames of {size[0]} x {size[1]} and of {width} x {height} pixels; "
                "give frames of one size"
            )
        frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24")
        matrix = None if encoding.lossless else "ITU709"
        output.mux(stream.encode(frame.reformat(format=encoding.pixels, dst_colorspace=matrix)))
    output.mux(stream.encode())


def _checksum(picture: Pixels) -> int:
    return zlib.crc32(np.ascontiguousarray(picture).data)


def _check(video: Path, checksums: list[int], path: Path) -> None:
    """Raise OutputError unless the video decodes to pictures of these checksums."""
    found = [_checksum(picture) for picture in read_video(video)]
    if found != checksums:
        wrong = sum(a != b for a, b in zip(found, checksums, strict=False))
        raise OutputError(
            f"{path}: of {len(checksums)} frames {len(found)} decode, {wrong} to other pixels; "
            "give another --codec"
        )

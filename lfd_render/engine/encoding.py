"""Pictures as the bytes of a media type."""

from __future__ import annotations

import io
import os
import shutil
import tempfile
import zipfile
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from lfd_render.errors import OutputError, UsageError
from lfd_render.panel.formats import write_exr
from lfd_render.panel.png import png_chunks

PNG = "image/png"
WEBP = "image/webp"
JPEG = "image/jpeg"
EXR = "image/x-exr"
RAW = "application/octet-stream"
ZIP = "application/zip"
NPY = "application/x-npy"
JSON = "application/json"

MOST_SIDE = {WEBP: 16383, JPEG: 65500}  # pixels that the formats, as written, hold
# Seconds a million pixels of noise take, times eight for a busy or slow machine: PNG 0.009, WebP
# 0.060, JPEG 0.011, EXR 0.050, bytes and numpy's 0.001, measured on one core of an x86 server.
_MOST_SECONDS = {PNG: 0.07, WEBP: 0.5, JPEG: 0.09, EXR: 0.4, ZIP: 0.07, RAW: 0.01, NPY: 0.01}
_JPEG_QUALITY = 92

Pixels = NDArray[np.uint8]


def encoded(
    pixels: Pixels,
    media: str,
    text: Mapping[str, str] | None = None,
    exif: bytes | None = None,
) -> bytes:
    """Bytes of uint8 [y, x, 3]: lossless but for JPEG. Text goes where the format has a place.

    Raises UsageError for a format that is none of these.
    """
    match media:
        case "image/png":
            return b"".join(png_chunks(pixels, text, exif))
        case "image/webp":
            return _webp(pixels)
        case "image/jpeg":
            file = io.BytesIO()
            Image.fromarray(pixels).save(file, "JPEG", quality=_JPEG_QUALITY, subsampling=0)
            return file.getvalue()
        case "application/octet-stream":
            return np.ascontiguousarray(pixels).tobytes()
    raise UsageError(f"media type '{media}': is none of this picture's")


def most_seconds(media: str, pixels: int) -> float:
    """How long encoding a picture may take before it is thought to hang."""
    return _MOST_SECONDS.get(media, 0.0) * pixels / 1e6


def exr(linear: NDArray[np.float16], text: Mapping[str, str]) -> bytes:
    """OpenEXR of scene-linear half floats [y, x, 3]. Raises OutputError without a place for it."""
    try:
        with tempfile.TemporaryDirectory(prefix=_prefix(os.getpid())) as folder:
            file = Path(folder) / "picture.exr"  # the library writes files alone
            write_exr(file, linear, text)
            return file.read_bytes()
    except OSError as error:
        raise OutputError(
            f"image/x-exr: no place for a file on its way: {error.strerror}"
        ) from error


def clear_up(pid: int) -> None:
    """Remove what a process that was killed has left of files on their way, if that can be."""
    with suppress(OSError):
        for left in Path(tempfile.gettempdir()).glob(f"{_prefix(pid)}*"):
            shutil.rmtree(left, ignore_errors=True)


def _prefix(pid: int) -> str:
    return f"lfd-render-{pid}-"


def zipped(files: Iterable[tuple[str, bytes]]) -> bytes:
    """An archive of files that are compressed already."""
    body = io.BytesIO()
    with zipfile.ZipFile(body, "w", zipfile.ZIP_STORED) as archive:
        for name, data in files:
            # A fixed date: the same pictures make the same archive.
            archive.writestr(zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0)), data)
    return body.getvalue()


def npy(array: NDArray[np.generic]) -> bytes:
    """The array in numpy's own format."""
    body = io.BytesIO()
    np.save(body, array, allow_pickle=False)
    return body.getvalue()


def _webp(pixels: Pixels) -> bytes:
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "WEBP", lossless=True, quality=0, method=0)
    return file.getvalue()

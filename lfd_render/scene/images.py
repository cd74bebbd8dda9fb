"""Decoding pictures: PNG, JPEG and WebP by their first bytes, several at a time, to RGBA8."""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image as PillowImage
from PIL import ImageFile, JpegImagePlugin, PngImagePlugin, WebPImagePlugin

from lfd_render.errors import ResourceError, SceneError
from lfd_render.scene.limits import Budget
from lfd_render.scene.model import Image

_STRIP_PIXELS = 1 << 20


@dataclass(frozen=True)
class ImageRequest:
    """One picture to decode; `label` says who needs it: material, slot and file."""

    name: str
    label: str
    read: Callable[[], bytes]


def decode_images(requests: Sequence[ImageRequest], budget: Budget) -> tuple[Image, ...]:
    """Decode all pictures, in order, on as many threads as there are cores (at least two).

    Raises SceneError for a picture that is missing, broken or of another format, ResourceError
    for one beyond the limits; of several failures the first in order is raised.
    """
    if not requests:
        return ()
    workers = min(len(requests), max(2, os.cpu_count() or 2))
    with ThreadPoolExecutor(workers, thread_name_prefix="decode") as pool:
        futures = [pool.submit(_decode, request, budget) for request in requests]
        try:
            return tuple(future.result() for future in futures)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _decode(request: ImageRequest, budget: Budget) -> Image:
    data = request.read()
    try:
        if _is_webp(data):  # its plugin makes room for all pixels as soon as it opens a file
            _check_size(*_webp_size(data), budget, request.label)
        with _open(data, request.label) as picture:
            _check_size(*picture.size, budget, request.label)
            budget.take("texels", picture.width * picture.height)
            return Image(request.name, _rgba(picture))
    except (SceneError, ResourceError):
        raise
    # Corrupt data makes the decoders raise nearly anything: OSError, SyntaxError, zlib.error, …
    except Exception as error:
        raise SceneError(
            f"{request.label}: cannot be decoded ({error}); give a whole PNG, JPEG or WebP"
        ) from None


def _open(data: bytes, label: str) -> ImageFile.ImageFile:
    """A picture whose header is read.

    The plugins are called directly: the format follows from the content alone, and the pixel cap
    is ours, where `Image.open` has one for the whole process that refuses 16K × 16K.
    """
    stream = io.BytesIO(data)
    if data.startswith(b"\x89PNG\r\n\x1a\n"):
        return PngImagePlugin.PngImageFile(stream)
    if data.startswith(b"\xff\xd8\xff"):
        return JpegImagePlugin.JpegImageFile(stream)
    if _is_webp(data):
        return WebPImagePlugin.WebPImageFile(stream)
    start = data[:8].hex(" ") or "nothing"
    raise SceneError(f"{label}: starts with {start}; give a PNG, JPEG or WebP")


def _check_size(width: int, height: int, budget: Budget, label: str) -> None:
    if width * height > budget.limits.image_pixels:
        raise ResourceError(
            f"{label}: {width} × {height} pixels; the limit is {budget.limits.image_pixels}, "
            "give a smaller picture"
        )


def _is_webp(data: bytes) -> bool:
    return data.startswith(b"RIFF") and data[8:12] == b"WEBP"


def _webp_size(data: bytes) -> tuple[int, int]:
    """Width and height from the first chunk of a WebP file (RFC 9649, section 2)."""
    kind, body = data[12:16], data[20:30].ljust(10, b"\0")
    if kind == b"VP8X":  # three bytes each, less one
        return int.from_bytes(body[4:7], "little") + 1, int.from_bytes(body[7:10], "little") + 1
    if kind == b"VP8L":  # 14 bits each, less one, after a signature byte
        bits = int.from_bytes(body[1:5], "little")
        return (bits & 0x3FFF) + 1, (bits >> 14 & 0x3FFF) + 1
    # VP8: 14 bits each after a frame tag and a start code
    bits = int.from_bytes(body[6:10], "little")
    return bits & 0x3FFF, bits >> 16 & 0x3FFF


def _rgba(picture: PillowImage.Image) -> NDArray[np.uint8]:
    """Pixels as [y, x, 4] uint8; 16-bit grey keeps its upper byte, absent alpha is opaque.

    Converted strip by strip: a 16K × 16K picture takes 1 GB decoded, and whole copies would
    triple that.
    """
    picture.load()
    width, height = picture.size
    pixels = np.empty((height, width, 4), np.uint8)
    rows = max(_STRIP_PIXELS // width, 1)
    for top in range(0, height, rows):
        strip = picture.crop((0, top, width, min(top + rows, height)))
        pixels[top : top + rows] = _strip_rgba(strip)
    return pixels


def _strip_rgba(strip: PillowImage.Image) -> NDArray[np.uint8]:
    if strip.mode in ("I;16", "I;16B", "I"):
        grey = (np.asarray(strip).astype(np.uint32) >> 8).astype(np.uint8)
        return np.stack((grey, grey, grey, np.full_like(grey, 255)), axis=-1)
    return np.asarray(strip if strip.mode == "RGBA" else strip.convert("RGBA"))

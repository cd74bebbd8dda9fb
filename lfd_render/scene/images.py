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
        with _open(data, request.label) as picture:
            width, height = picture.size
            _check_size(width, height, budget, request.label)
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
    if data.startswith(b"RIFF") and data[8:12] == b"WEBP":
        return WebPImagePlugin.WebPImageFile(stream)
    start = data[:8].hex(" ") or "nothing"
    raise SceneError(f"{label}: starts with {start}; give a PNG, JPEG or WebP")


def _check_size(width: int, height: int, budget: Budget, label: str) -> None:
    if width * height > budget.limits.image_pixels:
        raise ResourceError(
            f"{label}: {width} × {height} pixels; the limit is {budget.limits.image_pixels}, "
            "give a smaller picture"
        )
    budget.take("texels", width * height)


def _rgba(picture: PillowImage.Image) -> NDArray[np.uint8]:
    """Pixels as [y, x, 4] uint8; 16-bit grey keeps its upper byte, absent alpha is opaque."""
    if picture.mode in ("I;16", "I;16B", "I"):
        grey = (np.asarray(picture).astype(np.uint32) >> 8).astype(np.uint8)
        opaque = np.full_like(grey, 255)
        return np.stack((grey, grey, grey, opaque), axis=-1)
    return np.asarray(picture if picture.mode == "RGBA" else picture.convert("RGBA"))

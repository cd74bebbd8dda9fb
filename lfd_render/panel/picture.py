"""Picture files: panel images and views in and out, never half written."""

import struct
import warnings
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import ExifTags, Image, ImageOps, PngImagePlugin, UnidentifiedImageError

from lfd_render.display.files import replacing
from lfd_render.errors import PictureError, UsageError
from lfd_render.panel.png import png_chunks

Pixels = NDArray[np.uint8]

READABLE = ("PNG", "WEBP", "TIFF", "BMP", "JPEG")
MAX_PIXELS = 1 << 26  # two 8K panels
# Modes of 8 bits a channel; a 16-bit grey or float picture is no panel image.
_EIGHT_BIT_MODES = ("1", "L", "LA", "P", "PA", "RGB", "RGBA", "RGBX", "CMYK", "YCbCr")
GAP_PX = 8
PAPER = 255


@dataclass(frozen=True, eq=False)
class PictureFile:
    """What a picture file holds."""

    pixels: Pixels  # [y, x, 3]
    kind: str  # one of READABLE
    text: dict[str, str]  # of a PNG
    comment: bytes  # EXIF UserComment; empty where there is none


def read_picture(path: str | Path) -> Pixels:
    """Pixels of a PNG, WebP, TIFF, BMP or JPEG, uint8 [y, x, 3], alpha dropped.

    Orientation tags are not applied: a panel image is the panel's pixels as stored. Raises
    PictureError for a file that is missing, damaged, of another kind or above 67 megapixels.
    """
    return read_picture_file(path).pixels


def read_photograph(path: str | Path) -> Pixels:
    """Pixels of a camera's picture, uint8 [y, x, 3], upright as its orientation tag says.

    Raises PictureError as `read_picture` does.
    """
    with _opened(Path(path)) as image:
        if image.mode not in _EIGHT_BIT_MODES:
            raise PictureError(
                f"{path}: has pixels of mode {image.mode}; convert it to 8 bits a channel"
            )
        return np.array(ImageOps.exif_transpose(image).convert("RGB"))


def read_png_text(path: str | Path) -> dict[str, str]:
    """Text entries of a PNG, by key; empty for other formats. Raises PictureError."""
    with _opened(Path(path)) as image:
        return _text(image)


def read_picture_file(path: str | Path) -> PictureFile:
    """Pixels as `read_picture` gives them, with what else the file says. Raises PictureError."""
    with _opened(Path(path)) as image:
        if image.mode not in _EIGHT_BIT_MODES:
            raise PictureError(
                f"{path}: has pixels of mode {image.mode}; convert it to 8 bits a channel"
            )
        pixels = np.array(image.convert("RGB"))
        return PictureFile(pixels, image.format or "", _text(image), _user_comment(image))


def write_png(
    path: str | Path,
    pixels: Pixels,
    text: dict[str, str] | None = None,
    exif: bytes | None = None,
) -> None:
    """Write uint8 [y, x, 3] as a PNG with text entries and a TIFF structure of EXIF, if given; the
    file appears whole or not at all.

    Raises OutputError when the file cannot be written, UsageError for other pixels.
    """
    check_pixels(path, pixels)
    with replacing(Path(path)) as temporary, temporary.open("wb") as file:
        file.writelines(png_chunks(pixels, text, exif))


def check_pixels(path: str | Path, pixels: NDArray[Any]) -> None:
    """Raise UsageError for pixels that are no picture of 8 bits a channel."""
    if pixels.dtype != np.uint8 or pixels.ndim != 3 or pixels.shape[2] != 3 or not pixels.size:
        raise UsageError(
            f"{path}: pixels are {pixels.dtype} {list(pixels.shape)}; "
            "they should be uint8 [y, x, 3]"
        )


def _text(image: Image.Image) -> dict[str, str]:
    if not isinstance(image, PngImagePlugin.PngImageFile):
        return {}
    return {key: str(value) for key, value in image.text.items()}


def _user_comment(image: Image.Image) -> bytes:
    try:
        found = image.getexif().get_ifd(ExifTags.IFD.Exif).get(ExifTags.Base.UserComment, b"")
    except (OSError, ValueError, SyntaxError, struct.error):
        return b""  # damaged EXIF says nothing; the pixels are whole
    return found.encode() if isinstance(found, str) else bytes(found)


def side_by_side(pictures: Sequence[Pixels]) -> Pixels:
    """Pictures of one height, uint8 [y, x, 3] each, in a row with white gaps."""
    gap = np.full((pictures[0].shape[0], GAP_PX, 3), PAPER, np.uint8)
    parts = [part for picture in pictures for part in (gap, picture)][1:]
    return np.concatenate(parts, axis=1)


@contextmanager
def _opened(path: Path) -> Iterator[Image.Image]:
    """A picture of an accepted kind and size; whatever goes wrong is a PictureError."""
    kinds = ", ".join(READABLE)
    if path.is_fifo():  # opening one waits for whoever may never write
        raise PictureError(f"{path}: is a pipe; give a regular file")
    try:
        with ExitStack() as stack:
            with warnings.catch_warnings():
                # Pillow warns of large and of slightly damaged files; ours are errors or fine.
                warnings.simplefilter("ignore")
                image = stack.enter_context(Image.open(path, formats=READABLE))
                width, height = image.size
                if width * height > MAX_PIXELS:
                    raise PictureError(
                        f"{path}: has {width} x {height} pixels; at most {MAX_PIXELS} can be read"
                    )
                image.load()
            yield image
    except UnidentifiedImageError as cause:
        raise PictureError(f"{path}: is not a picture of a known kind; give {kinds}") from cause
    except Image.DecompressionBombError as cause:
        raise PictureError(
            f"{path}: is too large; at most {MAX_PIXELS} pixels can be read"
        ) from cause
    except (OSError, ValueError, SyntaxError, EOFError) as cause:
        reason = (isinstance(cause, OSError) and cause.strerror) or str(cause)
        raise PictureError(f"{path}: cannot be read: {reason}; give a {kinds} file") from cause

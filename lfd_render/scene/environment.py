"""Light from all around a scene: a panorama (EXR, HDR, TIFF, PNG, …) as scene-linear radiance."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lfd_render.errors import PictureError, ResourceError
from lfd_render.scene.limits import LoadLimits

MOST_WIDTH = 2048  # columns that reflections show; wider pictures are reduced
MOST_RADIANCE = 1e15  # of a texel; sums over a picture stay far below float32's end
_KINDS = "an EXR, HDR, TIFF or PNG file"


@dataclass(frozen=True, eq=False)
class Environment:
    """An equirectangular picture: `pixels` is [y, x, 3] float32, linear radiance, finite and ≥ 0.

    Row 0 shows +y (up), the columns run from −x by −z, +x and +z back to −x, so that the picture's
    middle is +x: the convention of the Khronos glTF viewer.
    """

    name: str
    pixels: NDArray[np.float32]
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check the picture; raises PictureError."""
        pixels = self.pixels
        if pixels.dtype != np.float32 or pixels.ndim != 3 or pixels.shape[2] != 3:
            raise PictureError(
                f"{self.name}: pixels are {pixels.dtype} {list(pixels.shape)}; "
                "give float32 [y, x, 3]"
            )
        height, width = pixels.shape[:2]
        if not height or abs(width - 2 * height) > 0.01 * width:
            raise PictureError(
                f"{self.name}: {width} × {height} pixels; give an equirectangular picture, "
                "twice as wide as high"
            )
        good = (pixels >= 0.0) & (pixels <= MOST_RADIANCE)
        if not good.all():
            y, x = np.argwhere(~good.all(axis=2))[0]
            raise PictureError(
                f"{self.name}: pixel ({x}, {y}) is {pixels[y, x].tolist()}; "
                f"give finite radiance from 0 to {MOST_RADIANCE:g}"
            )

    @staticmethod
    def load(path: str | Path, limits: LoadLimits | None = None) -> Environment:
        """Read a panorama; what has whole numbers for pixels is taken as sRGB, others as linear.

        Negative radiance, which filters of pictures leave behind, counts as 0, and pictures wider
        than reflections show are reduced, both with a warning. Raises PictureError, or
        ResourceError beyond the limits.
        """
        pixels = read_radiance(Path(path), limits or LoadLimits())
        warnings = []
        negative = (pixels < 0.0) & np.isfinite(pixels)
        if negative.any():
            count = np.count_nonzero(negative.any(axis=2))
            warnings.append(f"{path}: {count} pixels of negative radiance count as 0")
            pixels = np.where(negative, np.float32(0.0), pixels)
        whole = Environment(str(path), pixels)
        height, width = pixels.shape[:2]
        if width > MOST_WIDTH:
            warnings.append(
                f"{path}: {width} × {height} pixels are reduced to {MOST_WIDTH} columns"
            )
            pixels = _reduced(pixels, MOST_WIDTH, round(height * MOST_WIDTH / width))
        return Environment(whole.name, pixels, tuple(warnings))


def read_radiance(path: Path, limits: LoadLimits) -> NDArray[np.float32]:
    """Pixels [y, x, 3], linear; whole numbers are taken as sRGB. Raises PictureError, or
    ResourceError beyond the limits."""
    import OpenImageIO as oiio  # noqa: N813, PLC0415 (slow to import; its own documentation's name)

    if not path.is_file():  # opening a pipe waits for whoever may never write
        reason = "not a regular file" if path.exists() else "no such file"
        raise PictureError(f"{path}: {reason}; give {_KINDS}")
    source = oiio.ImageInput.open(str(path))
    if source is None:
        raise PictureError(f"{path}: cannot be read ({_reason(oiio.geterror())}); give {_KINDS}")
    try:
        spec = source.spec()
        if spec.width * spec.height > limits.image_pixels:
            raise ResourceError(
                f"{path}: {spec.width} × {spec.height} pixels; the limit is "
                f"{limits.image_pixels}, give a smaller picture"
            )
        channels = 3 if spec.nchannels >= 3 else 1
        pixels = None if spec.deep else source.read_image(0, 0, 0, channels, "float")
        if pixels is None:
            reason = "deep pixels" if spec.deep else _reason(source.geterror())
            raise PictureError(f"{path}: cannot be read ({reason}); give {_KINDS}, whole")
    finally:
        source.close()
    pixels = np.asarray(pixels, np.float32).reshape(spec.height, spec.width, channels)
    if spec.format.basetype not in (oiio.HALF, oiio.FLOAT, oiio.DOUBLE):
        pixels = _linear_from_srgb(pixels)
    return np.ascontiguousarray(np.broadcast_to(pixels, (spec.height, spec.width, 3)))


def _reason(text: str) -> str:
    return " ".join(text.split()) or "unknown format"


def _linear_from_srgb(encoded: NDArray[np.float32]) -> NDArray[np.float32]:
    """sRGB transfer function (IEC 61966-2-1), inverted."""
    high = ((np.maximum(encoded, 0.04045) + 0.055) / 1.055) ** 2.4
    return np.where(encoded <= 0.04045, encoded / 12.92, high).astype(np.float32)


def _reduced(pixels: NDArray[np.float32], width: int, height: int) -> NDArray[np.float32]:
    """The picture in fewer texels, each the mean of the area it covers, so that light is kept."""
    rows = _means(pixels, height)
    return np.ascontiguousarray(_means(rows.swapaxes(0, 1), width).swapaxes(0, 1))


def _means(pixels: NDArray[np.float32], to: int) -> NDArray[np.float32]:
    """The rows of a picture averaged to so many, parts of rows by their share."""
    edges = np.linspace(0.0, len(pixels), to + 1)
    means = np.empty((to, *pixels.shape[1:]), np.float32)
    for row, (low, high) in enumerate(pairwise(edges)):
        first, end = int(low), min(len(pixels), int(np.ceil(high)))
        places = np.arange(first, end)
        shares = np.minimum(high, places + 1) - np.maximum(low, places)
        means[row] = np.tensordot(shares / shares.sum(), pixels[first:end], axes=1)
    return means

"""Seamless procedural texture sets: base colour, normal, and occlusion-roughness-metallic.

All noise is spectral, so every texture tiles; seeds are fixed, so every run gives the same bytes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lfd_render.scene.model import Image

Field = NDArray[np.float32]  # [y, x], one tile, rows top to bottom


@dataclass(frozen=True, eq=False)
class TextureSet:
    """What a surface looks like over one tile, before it is packed into pictures.

    `color` is [rgb, y, x] in sRGB, 0…1; `height` is in tile widths and gives normals and
    occlusion; roughness and metallic are fields or numbers in 0…1.
    """

    name: str
    color: Field
    height: Field
    roughness: Field | float
    metallic: Field | float = 0.0

    def images(self) -> tuple[Image, Image, Image]:
        """Base colour (sRGB), tangent-space normals (+y up), and occlusion-roughness-metallic."""
        return (
            Image(f"{self.name} base colour", to_pixels(self.color)),
            Image(f"{self.name} normal", normal_pixels(self.height)),
            Image(f"{self.name} occlusion-roughness-metallic", self._orm()),
        )

    def _orm(self) -> NDArray[np.uint8]:
        # Hollows see less of the sky: depth below the smoothed surface, in 1/60 of a tile.
        occlusion = 1.0 + 60.0 * np.minimum(self.height - _smooth(self.height), 0.0)
        return to_pixels((occlusion, self.roughness, self.metallic))


def mosaic(
    make: Callable[[int], tuple[Image, Image, Image]], blocks: int, seed: int = 11
) -> tuple[Image, Image, Image]:
    """Pictures put together from `blocks` each way, each made from its own seed; the edges of
    what is made should hide that neighbours do not fit."""
    first = make(seed)
    if blocks == 1:
        return first
    size = len(first[0].pixels)
    wholes = [np.empty((blocks * size, blocks * size, 4), np.uint8) for _ in first]
    for row, column in np.ndindex(blocks, blocks):
        block = make(seed + 101 * (row * blocks + column)) if row + column else first
        place = np.s_[row * size : (row + 1) * size, column * size : (column + 1) * size]
        for whole, image in zip(wholes, block, strict=True):
            whole[place] = image.pixels
    color, normal, orm = (
        Image(image.name, whole) for image, whole in zip(first, wholes, strict=True)
    )
    return color, normal, orm


def to_pixels(channels: Field | Sequence[NDArray[np.floating] | float]) -> NDArray[np.uint8]:
    """Three channels in 0…1, each [y, x] or a number, as opaque [y, x, 4] bytes, rounded."""
    red, green, blue = np.broadcast_arrays(*channels)
    pixels = np.full((*red.shape, 4), 255, np.uint8)
    for i, channel in enumerate((red, green, blue)):
        pixels[..., i] = np.clip(channel, 0.0, 1.0) * np.float32(255.0) + np.float32(0.5)
    return pixels


def normal_pixels(height: Field) -> NDArray[np.uint8]:
    """Tangent-space normals of a tiling height field: x along u, y up the picture (glTF)."""
    size = np.float32(len(height))
    slope_x = (np.roll(height, -1, axis=1) - np.roll(height, 1, axis=1)) * (size / 2)
    slope_y = (np.roll(height, 1, axis=0) - np.roll(height, -1, axis=0)) * (size / 2)
    half = 0.5 / np.sqrt(slope_x**2 + slope_y**2 + np.float32(1.0))
    return to_pixels((0.5 - slope_x * half, 0.5 - slope_y * half, 0.5 + half))


@lru_cache(maxsize=8)
def _frequency(size: int) -> Field:
    """Cycles a tile of each coefficient of rfft2, [size, size // 2 + 1]; 1 at the constant."""
    fy = np.fft.fftfreq(size, 1.0 / size).astype(np.float32)[:, None]
    fx = np.fft.rfftfreq(size, 1.0 / size).astype(np.float32)[None, :]
    frequency = np.hypot(fy, fx)
    frequency[0, 0] = 1.0
    return frequency


def noise(size: int, seed: int, falloff: float = 1.6, lowest: float = 1.0) -> Field:
    """Tiling fractal noise of mean 0 and deviation 1: amplitude ∝ frequency^−falloff.

    `lowest` is the frequency, in cycles a tile, below which amplitudes fade out.
    """
    generator = np.random.default_rng(seed)
    frequency = _frequency(size)
    # Only amplitudes above 1/1000 of the strongest are seen, but drawing all keeps it simple;
    # the order of draws is row by row, so a size has its own pattern.
    phase = generator.random(frequency.shape, np.float32) * np.float32(2.0 * np.pi)
    amplitude = frequency ** np.float32(-falloff - 0.5)
    amplitude *= np.minimum(frequency / np.float32(lowest), 1.0) ** 2
    amplitude[0, 0] = 0.0
    spectrum = np.empty(frequency.shape, np.complex64)
    spectrum.real = amplitude * np.cos(phase)
    spectrum.imag = amplitude * np.sin(phase)
    field: Field = np.fft.irfft2(spectrum, s=(size, size)).astype(np.float32)
    field /= field.std()
    return field


def ridge(size: int, seed: int, falloff: float = 1.0) -> Field:
    """A tiling skyline, [1, size], of mean 0 and deviation 1: amplitude ∝ frequency^−falloff."""
    generator = np.random.default_rng(seed)
    frequency = np.arange(size // 2 + 1, dtype=np.float32)
    phase = generator.random(len(frequency), np.float32) * np.float32(2.0 * np.pi)
    frequency[0] = 1.0
    spectrum = frequency ** np.float32(-falloff - 0.5) * np.exp(1j * phase)
    spectrum[0] = 0.0
    line: Field = np.fft.irfft(spectrum, size).astype(np.float32)[None, :]
    line /= line.std()
    return line


def _smooth(field: Field, cutoff: float = 24.0) -> Field:
    """The field without detail finer than `cutoff` cycles a tile."""
    size = len(field)
    spectrum = np.fft.rfft2(field)
    spectrum *= np.exp(-((_frequency(size) / np.float32(cutoff)) ** 2))
    smoothed: Field = np.fft.irfft2(spectrum, s=(size, size)).astype(np.float32)
    return smoothed


def grid(size: int) -> tuple[Field, Field]:
    """Texel centres u [1, size] and v [size, 1] in 0…1; v runs down."""
    line = (np.arange(size, dtype=np.float32) + np.float32(0.5)) / np.float32(size)
    return line[None, :], line[:, None]


def mix(first: Field, second: Field, share: Field) -> Field:
    """Fields or colours blended: 0 gives the first, 1 the second.

    Colours are [rgb, y, x] or [rgb, 1, 1], the share [y, x] and clipped to 0…1. Colours are planar
    because numpy broadcasts along a last axis of 3 several times slower.
    """
    mixed: Field = (second - first) * np.clip(share, np.float32(0.0), np.float32(1.0))
    mixed += first
    return mixed


def rgb(code: str) -> Field:
    """An sRGB colour from six hexadecimal digits, [rgb, 1, 1] in 0…1."""
    levels = np.frombuffer(bytes.fromhex(code), np.uint8).astype(np.float32)
    return (levels / np.float32(255.0)).reshape(3, 1, 1)

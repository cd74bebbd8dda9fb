"""A lenticular panel and a camera, for tests and the tutorial: photographs of patterns, simulated.

Written from the physical lens (pitch across the axis, tilt, gap, index) in millimetres, apart from
the package's own formulas: each ray of the camera goes to a place on the panel; the lens above it
sends the ray from its axis to the panel, across the axis only; there each subpixel of the pixel
row counts by a Gaussian of its distance across the axis. Then come blur, vignetting, exposure,
noise and the camera's 8 bits.

    python tests/photographs.py PATTERNS -o PHOTOS [--distance MM] [--seed N] [--wall]
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

Float64 = NDArray[np.float64]
Pixels = NDArray[np.uint8]


@dataclass(frozen=True)
class Panel:
    """The hidden truth. tilt: degrees from vertical, positive when the lens leans left going up."""

    resolution_px: tuple[int, int] = (480, 270)
    size_mm: tuple[float, float] = (43.2, 24.3)
    pitch_mm: float = 0.72  # across the axis
    tilt_deg: float = 9.66
    gap_mm: float = 1.53
    index: float = 1.49
    phase: float = 0.3  # lenses at the middle of the panel
    sigma_lenses: float = 0.03
    bow: float = 0.0  # lenses by which the sheet is off its lattice at the left and right, smoothly
    offsets_px: tuple[float, float, float] = (-1 / 3, 0.0, 1 / 3)  # from the pixel's centre

    def seen(self, distance_mm: float) -> tuple[float, float, float]:
        """(P, T, center) of the phase formula for an eye in the middle at this distance, at +0
        from the pixel's centre."""
        width, height = self.size_mm
        alpha = math.radians(self.tilt_deg)
        across = self.pitch_mm / math.cos(alpha) * (1 + self.gap_mm / (self.index * distance_mm))
        count, drift = width / across, height / width * math.tan(alpha)
        return count, drift, count / 2 + drift * count / 2 - self.phase


@dataclass(frozen=True)
class Camera:
    """Where a camera stands, what it sees of the panel, and what it does to the light.

    corners: of the panel in the photograph, top left, top right, bottom right, bottom left.
    """

    size_px: tuple[int, int] = (600, 400)
    corners: tuple[tuple[float, float], ...] = ((52, 44), (560, 30), (545, 352), (38, 338))
    position_mm: tuple[float, float, float] = (0.0, 0.0, 600.0)
    rays: int = 1  # a side of a pixel
    blur_px: float = 0.7
    noise_db: float = 30.0  # peak signal to noise, in encoded values
    exposure: float = 0.8  # light of a white panel
    vignetting: float = 0.15  # loss in the corners
    ambient: float = 0.01
    gamma: float = 1.0  # of the camera beyond sRGB
    distortion: float = 0.0  # radial, of half the photograph's diagonal
    mixing: float = 0.08  # of a colour into each of the others


@dataclass
class Photographer:
    """Photographs of one panel by one camera."""

    panel: Panel
    camera: Camera
    _index: NDArray[np.int64] = field(init=False)
    _weight: NDArray[np.float32] = field(init=False)  # [ray, place, channel]
    _inside: NDArray[np.bool_] = field(init=False)

    def __post_init__(self) -> None:
        x, y, self._inside = self._rays()
        self._index, weight = self._through_lenses(x[self._inside], y[self._inside])
        self._weight = weight.astype(np.float32)

    def _rays(self) -> tuple[Float64, Float64, NDArray[np.bool_]]:
        """Places on the panel in mm from its middle, y up, and whether they are on it."""
        width, height = self.camera.size_px
        rays = self.camera.rays
        part = (np.arange(rays) + 0.5) / rays
        px = (np.arange(width)[:, None] + part).ravel()[None, :].repeat(height * rays, 0)
        py = (np.arange(height)[:, None] + part).ravel()[:, None].repeat(width * rays, 1)
        half = math.hypot(width, height) / 2
        dx, dy = (px - width / 2) / half, (py - height / 2) / half
        bend = 1 + self.camera.distortion * (dx**2 + dy**2)
        px, py = width / 2 + dx * bend * half, height / 2 + dy * bend * half
        # The unit square's homography, its coefficients by Heckbert's closed form.
        (x0, y0), (x1, y1), (x2, y2), (x3, y3) = self.camera.corners
        sx, sy = x0 - x1 + x2 - x3, y0 - y1 + y2 - y3
        ex, ey, fx, fy = x1 - x2, y1 - y2, x3 - x2, y3 - y2
        det = ex * fy - fx * ey
        g, h = (sx * fy - fx * sy) / det, (ex * sy - sx * ey) / det
        to_photo = np.array(
            [
                [x1 - x0 + g * x1, x3 - x0 + h * x3, x0],
                [y1 - y0 + g * y1, y3 - y0 + h * y3, y0],
                [g, h, 1],
            ]
        )
        q = np.linalg.inv(to_photo) @ np.stack([px.ravel(), py.ravel(), np.ones(px.size)])
        u, v = q[0] / q[2], q[1] / q[2]
        inside = (u > 0) & (u < 1) & (v > 0) & (v < 1)
        mm = self.panel.size_mm
        return (u - 0.5) * mm[0], (0.5 - v) * mm[1], inside

    def _through_lenses(self, x: Float64, y: Float64) -> tuple[NDArray[np.int64], Float64]:
        """Subpixels that each ray sees, as pixel indices [ray, place], and their weights."""
        panel, (eye_x, eye_y, eye_z) = self.panel, self.camera.position_mm
        columns, rows = panel.resolution_px
        pitch = panel.size_mm[0] / columns, panel.size_mm[1] / rows
        alpha = math.radians(panel.tilt_deg)
        depth = panel.gap_mm / panel.index  # apparent depth of the panel behind the lenses
        nearer = depth / (eye_z + depth)
        lens_x, lens_y = x + (eye_x - x) * nearer, y + (eye_y - y) * nearer
        across = (lens_x * math.cos(alpha) + lens_y * math.sin(alpha)) / panel.pitch_mm
        place = across + panel.phase + panel.bow * ((2 * lens_x / panel.size_mm[0]) ** 2 - 1 / 3)
        to_axis = (np.floor(place) + 0.5 - place) * panel.pitch_mm
        axis_x = lens_x + to_axis * math.cos(alpha)
        axis_y = lens_y + to_axis * math.sin(alpha)
        seen_x = axis_x + (axis_x - eye_x) * depth / eye_z
        seen_y = axis_y + (axis_y - eye_y) * depth / eye_z

        column = np.floor((seen_x + panel.size_mm[0] / 2) / pitch[0]).astype(np.int64)
        row = np.floor((panel.size_mm[1] / 2 - seen_y) / pitch[1]).astype(np.int64)
        row = np.clip(row, 0, rows - 1)
        row_y = panel.size_mm[1] / 2 - (row + 0.5) * pitch[1]
        sigma = panel.sigma_lenses * panel.pitch_mm
        reach = 1 + math.ceil(3 * sigma / pitch[0])
        steps = np.arange(-reach, reach + 1)
        near = column[:, None] + steps
        subpixel = (near + 0.5)[..., None] + np.array(panel.offsets_px)
        subpixel_x = subpixel * pitch[0] - panel.size_mm[0] / 2
        miss = (subpixel_x - seen_x[:, None, None]) * math.cos(alpha)
        miss += ((row_y - seen_y) * math.sin(alpha))[:, None, None]
        weight = np.exp(-0.5 * (miss / sigma) ** 2)
        weight *= pitch[0] * math.cos(alpha) / (sigma * math.sqrt(2 * math.pi))
        weight[(near < 0) | (near >= columns)] = 0
        return row[:, None] * columns + np.clip(near, 0, columns - 1), weight

    def light(self, pattern: Pixels) -> Float64:
        """Light at the sensor, [y, x, 3], a white panel 1."""
        assert pattern.shape[1::-1] == self.panel.resolution_px, pattern.shape
        linear = decoded(np.arange(256) / 255).astype(np.float32)[pattern].reshape(-1, 3)
        light = np.zeros((self._inside.size, 3))
        for channel in range(3):
            if linear[:, channel].any():
                seen = np.ascontiguousarray(linear[:, channel])[self._index]
                weight = self._weight[..., channel]
                light[self._inside, channel] = np.einsum("rp,rp->r", seen, weight)
        rays, (width, height) = self.camera.rays, self.camera.size_px
        return light.reshape(height, rays, width, rays, 3).mean(axis=(1, 3))

    def photograph(
        self, pattern: Pixels, rng: np.random.Generator, exposure: float = 1.0
    ) -> Pixels:
        """One photograph, uint8 [y, x, 3]; `exposure` is further to the camera's own."""
        camera = self.camera
        light = blurred(self.light(pattern), camera.blur_px)
        mix = np.full((3, 3), camera.mixing) + (1 - 3 * camera.mixing) * np.eye(3)
        width, height = camera.size_px
        dx = (np.arange(width) + 0.5 - width / 2)[None, :]
        dy = (np.arange(height) + 0.5 - height / 2)[:, None]
        fall = 1 - camera.vignetting * (dx**2 + dy**2) / (width**2 + height**2) * 4
        light = (light @ mix + camera.ambient) * fall[..., None] * camera.exposure * exposure
        codes = encoded(np.clip(light, 0, None)) ** camera.gamma
        codes += rng.normal(0, 10 ** (-camera.noise_db / 20), codes.shape)
        return np.rint(255 * np.clip(codes, 0, 1)).astype(np.uint8)

    def photographs(
        self, patterns: Mapping[str, Pixels], rng: np.random.Generator
    ) -> dict[str, Pixels]:
        """A photograph of each pattern."""
        return {name: self.photograph(pattern, rng) for name, pattern in patterns.items()}


def decoded(code: Float64) -> Float64:
    """Light of sRGB values, 0 to 1."""
    return np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)


def encoded(light: Float64) -> Float64:
    """sRGB values of light."""
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def blurred(light: Float64, sigma_px: float) -> Float64:
    """Gaussian blur of [y, x, channel]."""
    if not sigma_px:
        return light
    reach = math.ceil(3 * sigma_px)
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma_px) ** 2)
    kernel /= kernel.sum()
    for axis in (0, 1):
        padded = np.pad(light, [(reach, reach) if a == axis else (0, 0) for a in range(3)])
        size = light.shape[axis]
        parts = (k * np.take(padded, range(i, i + size), axis=axis) for i, k in enumerate(kernel))
        light = sum(parts, np.zeros(1))
    return light


def wall(size_px: tuple[int, int], rng: np.random.Generator) -> Pixels:
    """A photograph of a blank wall in uneven light."""
    width, height = size_px
    across, down = np.linspace(-1, 1, width)[None, :], np.linspace(-1, 1, height)[:, None]
    shade = 0.5 + 0.1 * across + 0.05 * down
    codes = shade[..., None] + rng.normal(0, 0.0316, (height, width, 3))
    return np.rint(255 * np.clip(codes, 0, 1)).astype(np.uint8)


def main(arguments: Iterable[str] | None = None) -> None:
    """Photograph a folder of patterns."""
    parser = argparse.ArgumentParser(description="Photograph the patterns of a folder.")
    parser.add_argument("patterns", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--distance", type=float, default=600.0, help="of the camera, mm")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--wall", action="store_true", help="a blank wall instead")
    chosen = parser.parse_args(None if arguments is None else list(arguments))
    rng = np.random.default_rng(chosen.seed)
    camera = Camera(position_mm=(0.0, 0.0, chosen.distance))
    photographer = Photographer(Panel(), camera)
    chosen.output.mkdir(exist_ok=True)
    for file in sorted(chosen.patterns.glob("*.png")):
        pattern = np.asarray(Image.open(file).convert("RGB"))
        taken = wall(camera.size_px, rng) if chosen.wall else photographer.photograph(pattern, rng)
        Image.fromarray(taken).save(chosen.output / file.name)


if __name__ == "__main__":
    main()

"""Encoding: scene-linear light → an 8-bit sRGB picture."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float64 = NDArray[np.float64]

FRESNEL = 0.04  # what the curve takes off, as a dielectric adds it
START = 0.8 - FRESNEL  # where compression starts
DESATURATION = 0.15


def encoded(linear: NDArray[np.floating], exposure: float = 1.0) -> NDArray[np.uint8]:
    """Picture uint8 [..., rgb] of linear light [..., rgb]."""
    return np.rint(255.0 * encoded_float(linear, exposure)).astype(np.uint8)


def encoded_float(linear: NDArray[np.floating], exposure: float = 1.0) -> Float64:
    """The same before rounding, 0…1."""
    lit = np.maximum(linear.astype(np.float64), 0.0) * exposure
    return srgb_from_linear(np.clip(neutral(lit), 0.0, 1.0))


def neutral(color: Float64) -> Float64:
    """Khronos PBR Neutral tone curve (Khronos 2024, specification): what is below the start keeps
    its colour less a Fresnel toe, peaks above it approach 1 and lose saturation."""
    least = color.min(axis=-1, keepdims=True)
    toe = np.where(least < 2.0 * FRESNEL, least - least**2 / (4.0 * FRESNEL), FRESNEL)
    color = color - toe
    peak = color.max(axis=-1, keepdims=True)
    room = 1.0 - START
    # Only peaks above the start are compressed; below it the formulas would not hold.
    high = np.maximum(peak, START)
    compressed = 1.0 - room**2 / (high + room - START)
    saturation = 1.0 / (DESATURATION * (high - compressed) + 1.0)
    bright = compressed + saturation * (color * compressed / high - compressed)
    return np.where(peak < START, color, bright)


def srgb_from_linear(linear: Float64) -> Float64:
    """sRGB transfer function (IEC 61966-2-1)."""
    high = 1.055 * np.maximum(linear, 0.0031308) ** (1.0 / 2.4) - 0.055
    return np.where(linear <= 0.0031308, 12.92 * linear, high)

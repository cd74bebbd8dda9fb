"""Encoding: scene-linear light → an 8-bit sRGB picture."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float64 = NDArray[np.float64]

SHOULDER = 0.8  # where compression starts


def encoded(linear: NDArray[np.floating], exposure: float = 1.0) -> NDArray[np.uint8]:
    """Picture uint8 [..., rgb] of linear light [..., rgb]."""
    return np.rint(255.0 * encoded_float(linear, exposure)).astype(np.uint8)


def encoded_float(linear: NDArray[np.floating], exposure: float = 1.0) -> Float64:
    """The same before rounding, 0…1."""
    lit = np.maximum(linear.astype(np.float64), 0.0) * exposure
    return srgb_from_linear(np.clip(shouldered(lit), 0.0, 1.0))


def shouldered(light: Float64) -> Float64:
    """Tone curve, each channel by itself, since subpixels of a panel pixel show different views:
    the light itself up to the shoulder, from there the hyperbola of the same slope towards 1."""
    room = 1.0 - SHOULDER
    over = np.maximum(light - SHOULDER, 0.0) / room
    return np.where(light <= SHOULDER, light, SHOULDER + room * over / (1.0 + over))


def srgb_from_linear(linear: Float64) -> Float64:
    """sRGB transfer function (IEC 61966-2-1)."""
    high = 1.055 * np.maximum(linear, 0.0031308) ** (1.0 / 2.4) - 0.055
    return np.where(linear <= 0.0031308, 12.92 * linear, high)

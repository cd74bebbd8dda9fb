"""The beat of two lattices: fringes of a pattern made for a guess, seen through the true lenses.

Where the guess has the phase φ_g and the lenses φ_f, the eye in the middle sees the pattern at
φ_f = ½, so the fringes have the phase

    δ = φ_g − φ_f = a·u + b·v + d        a = P_g − P, b = (T·P)_g − T·P, d = center − center_g

one plane for each camera position, with a `d` of its own for each colour. A plane is first found as
the strongest frequency of all blocks together, so that nothing need be unwrapped, then by weighted
least squares on what remains of the phases, robustly.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Float64 = NDArray[np.float64]
Complex = NDArray[np.complex128]

_PADDING = 4
_ROUNDS = 30
_TUKEY = 4.685  # in robust standard deviations: 95 % efficient for a Gaussian
_LEAST_SPREAD = 1e-5  # in cycles, below which residuals are numerical


@dataclass(frozen=True, eq=False)
class Beat:
    """A fitted plane, in cycles.

    slopes: (a, b); offsets: d of each group; residual [group, block] with NaN where nothing counts;
    covariance of (a, b, d about the panel's middle …), from the residuals' scatter, which may hang
    together over neighbouring blocks; coherence: share of the light's swing that follows the plane;
    rival: the strongest frequency elsewhere, relative to the one taken.
    """

    slopes: tuple[float, float]
    offsets: Float64  # at u = v = 0
    middle: Float64  # the same at u = v = ½
    residual: Float64
    covariance: Float64
    project: Float64  # parameters from phases of all groups and blocks, [parameter, group·block]
    coherence: float
    rival: float


def fit_beat(u: Float64, v: Float64, swing: Complex, grid: tuple[int, int]) -> Beat:
    """Plane of the phases of `swing`, complex [group, block], 0 where a block counts for nothing.

    u, v: [block], row by row of `grid` (rows, columns).
    """
    groups = len(swing)
    a, b, rival = _strongest(u, v, swing, grid)
    # About the middle the slopes and the offsets hardly depend on each other.
    across, up = u - 0.5, v - 0.5
    design = np.zeros((groups, u.size, 2 + groups))
    design[..., 0], design[..., 1] = across, up
    for group in range(groups):
        design[group, :, 2 + group] = 1
    flat = design.reshape(-1, 2 + groups)
    magnitude = np.abs(swing)
    typical = np.median(magnitude[magnitude > 0])
    weight = np.minimum(magnitude / typical, 2.0) ** 2

    plane = np.zeros(2 + groups)
    plane[:2] = a, b
    turn = swing * np.exp(-2j * np.pi * (a * across + b * up))
    plane[2:] = np.angle(turn.sum(axis=1)) / (2 * np.pi)
    robust: Float64 = weight
    residual: NDArray[Any] = np.zeros(swing.shape)
    for _ in range(_ROUNDS):
        fitted = (flat @ plane).reshape(swing.shape)
        residual = np.angle(swing * np.exp(-2j * np.pi * fitted)) / (2 * np.pi)
        counted = weight > 0
        spread = max(1.4826 * float(np.median(np.abs(residual[counted]))), _LEAST_SPREAD)
        # A block of little light is noisier, and may miss by more before it is an outlier.
        miss = residual * np.sqrt(weight) / (_TUKEY * spread)
        robust = weight * np.where(np.abs(miss) < 1, (1 - miss**2) ** 2, 0)
        change = _solve(flat, robust.ravel(), residual.ravel())
        plane += change
        if np.abs(change).max() < 1e-9:
            break
    fitted = (flat @ plane).reshape(swing.shape)
    residual = np.angle(swing * np.exp(-2j * np.pi * fitted)) / (2 * np.pi)
    coherent = np.abs((swing * np.exp(-2j * np.pi * fitted)).sum(axis=1)).sum()

    normal = flat.T @ (robust.ravel()[:, None] * flat)
    inverse = np.asarray(np.linalg.inv(normal), np.float64)
    variance = float((robust * residual**2).sum() / max(np.count_nonzero(robust) - 2 - groups, 1))
    variance *= _together(residual, robust, grid, variance)
    middle = np.array(plane[2:], np.float64)
    return Beat(
        (float(plane[0]), float(plane[1])),
        np.asarray(middle - (plane[0] + plane[1]) / 2, np.float64),
        middle,
        np.where(weight > 0, residual, np.nan),
        inverse * variance,
        inverse @ (robust.ravel()[:, None] * flat).T,
        float(coherent / magnitude.sum()),
        rival,
    )


def _solve(design: Float64, weight: Float64, value: Float64) -> Float64:
    normal = design.T @ (weight[:, None] * design)
    found = np.linalg.lstsq(normal, design.T @ (weight * value), rcond=None)[0]
    return np.asarray(found, np.float64)


def _strongest(
    u: Float64, v: Float64, swing: Complex, grid: tuple[int, int]
) -> tuple[float, float, float]:
    """Slopes (a, b) of the strongest frequency of all groups, and its strongest rival."""
    rows, columns = grid
    shape = (_PADDING * rows, _PADDING * columns)
    power: NDArray[Any] = np.zeros(shape)
    for group in swing:
        size = np.maximum(np.abs(group), 1e-30)
        even = group / size * np.minimum(size, np.median(size))
        power += np.abs(np.fft.fft2(even.reshape(grid), s=shape)) ** 2
    y, x = divmod(int(np.argmax(power)), shape[1])
    peak = float(power[y, x])
    # Blocks lie at equal steps but for the pixels that they happen to hold.
    step_u = float(np.median(np.diff(u.reshape(grid), axis=1)))
    step_v = float(np.median(np.diff(v.reshape(grid), axis=0)))
    a = float(np.fft.fftfreq(shape[1])[x]) / step_u
    b = float(np.fft.fftfreq(shape[0])[y]) / step_v
    rows_off = (np.arange(shape[0]) - y + shape[0] // 2) % shape[0] - shape[0] // 2
    columns_off = (np.arange(shape[1]) - x + shape[1] // 2) % shape[1] - shape[1] // 2
    far = (np.abs(rows_off)[:, None] > 2 * _PADDING) | (np.abs(columns_off) > 2 * _PADDING)
    return a, b, float(np.sqrt(float(np.where(far, power, 0).max()) / (peak + 1e-300)))


def _together(residual: Float64, weight: Float64, grid: tuple[int, int], variance: float) -> float:
    """By how much the means of neighbouring blocks scatter more than if each were by itself."""
    rows, columns = grid
    worst: float = 1.0
    for side in (2, 4, 8):
        if min(rows, columns) < 2 * side:
            break
        cut = (slice(rows // side * side), slice(columns // side * side))

        def sums(values: Float64, side: int = side, cut: tuple[slice, slice] = cut) -> Float64:
            part = values.sum(axis=0).reshape(grid)[cut]
            found: Float64 = part.reshape(part.shape[0] // side, side, -1, side).sum(axis=(1, 3))
            return found

        total, weights = sums(residual * weight), sums(weight)
        some = weights > 0
        degrees = max(int(np.count_nonzero(some)) - 3, 1)
        scatter = float((total[some] ** 2 / weights[some]).sum()) / degrees
        worst = max(worst, scatter / max(variance, 1e-300))
    return worst

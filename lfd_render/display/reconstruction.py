"""How a subpixel's colour is put together from view images, and the samples of its filter.

A subpixel of phase φ lies at the view coordinate a = N·(1 − frac φ), where view i covers i to
i + 1, on the window at u = (q + center)/P − v·T with q = ⌊φ⌋ + ½ (`lens`) or φ (`subpixel`), and at
the row coordinate (y + ½)·rows/H. Views are looked up there, the nearest or two of them, or
filtered about it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from lfd_render.errors import UsageError

LOOKUPS = ("lens", "subpixel")
WEAVES = ("nearest", "linear")
FILTERS = ("none", "spatial", "angular", "both")
FILTER_SAMPLES = 8
SPATIAL_DIAMETER_PX = 2.25  # Gavane and Watson 2024, section 4; σ is a quarter of it
ANGULAR_SUPPORT_VIEWS = 2.0  # over all: one view interval to either side
MOST_SAMPLES = 64
_DRAWS = 400


@dataclass(frozen=True)
class Reconstruction:
    """lookup: where views are sampled, of LOOKUPS; weave: the nearest view or linear between two,
    of WEAVES; aa: Gaussian filter over view pixels, views or both, of FILTERS, by `samples`
    samples.

    pixel: what is a view pixel to the filter, in columns and rows of the view images; view: what is
    a view interval to it, in views. Raises UsageError.
    """

    lookup: str = "lens"
    weave: str = "nearest"
    aa: str = "none"
    samples: int = FILTER_SAMPLES
    pixel: tuple[float, float] = (1.0, 1.0)
    view: float = 1.0

    def __post_init__(self) -> None:
        """Check the choices."""
        for name, choice, choices in (
            ("lookup", self.lookup, LOOKUPS),
            ("weave", self.weave, WEAVES),
            ("aa", self.aa, FILTERS),
        ):
            if choice not in choices:
                raise UsageError(f"{name} '{choice}': unknown; use {' or '.join(choices)}")
        if self.aa != "none" and self.weave != "nearest":
            raise UsageError(
                f"aa '{self.aa}': its samples take the nearest view; drop weave '{self.weave}'"
            )
        if not 2 <= self.samples <= MOST_SAMPLES or self.samples % 2:
            raise UsageError(
                f"samples: {self.samples} is out of range; use an even number, 2 to {MOST_SAMPLES}"
            )

    @property
    def spatial(self) -> bool:
        """Whether samples spread over columns and rows."""
        return self.aa in ("spatial", "both")

    @property
    def angular(self) -> bool:
        """Whether samples spread over views."""
        return self.aa in ("angular", "both")

    def offsets(self) -> NDArray[np.float64]:
        """Samples about a subpixel, [sample, 3]: columns, rows, views; one of zeros unfiltered."""
        if self.aa == "none":
            return np.zeros((1, 3))
        reach = (
            self.spatial * self.pixel[0],
            self.spatial * self.pixel[1],
            self.angular * self.view,
        )
        found: NDArray[np.float64] = gaussian_samples(self.samples) * np.array(reach)
        return found

    @property
    def halo(self) -> int:
        """View rows around those that the panel shows which samples may reach."""
        return math.ceil(0.5 * SPATIAL_DIAMETER_PX * self.pixel[1]) if self.spatial else 0


@cache
def gaussian_samples(count: int) -> NDArray[np.float64]:
    """The fixed set of samples, [sample, 3]: view columns, view rows, views; read-only.

    Each has a Gaussian distribution cut at its support: of diameter 2.25 pixels over columns and
    rows together, ± 1 view over views; σ is a quarter of the whole width. Equal parts of either
    distribution give one pair of samples each, and the samples of a pair lie opposite each other,
    so that the filter moves nothing. Which radius goes with which turn and view is drawn at random,
    the most even of many draws; where samples are eight or more, all ways lead some from any place,
    so that at a corner of the views some are inside.
    """
    pairs = count // 2
    part = (np.arange(pairs) + 0.5) / pairs
    # A Gaussian disc, cut at 2σ: the radius that holds a part of it.
    radius = np.sqrt(-2.0 * np.log1p(-part * (1.0 - math.exp(-2.0))))
    turn = np.pi * part
    normal = NormalDist()
    whole = normal.cdf(2.0) - 0.5
    apart = np.array([normal.inv_cdf(0.5 + p * whole) for p in part])
    draws = np.random.RandomState(0)  # its numbers never change
    best, least = np.empty((pairs, 3)), math.inf
    for _ in range(_DRAWS):
        turned = turn[draws.permutation(pairs)]
        views = apart[draws.permutation(pairs)] * draws.choice((-1.0, 1.0), pairs)
        half = np.stack([radius * np.cos(turned), radius * np.sin(turned), views], axis=-1)
        spread = half.T @ half / pairs
        uneven = (spread[0, 0] - spread[1, 1]) ** 2 + (np.triu(spread, 1) ** 2).sum()
        ways = len({tuple(s) for s in np.sign(np.concatenate([half, -half]))})
        if uneven < least and ways == min(count, 8):
            best, least = half, uneven
    sigma = np.array([SPATIAL_DIAMETER_PX, SPATIAL_DIAMETER_PX, ANGULAR_SUPPORT_VIEWS]) / 4.0
    samples: NDArray[np.float64] = np.concatenate([best, -best]) * sigma
    samples.flags.writeable = False
    return samples

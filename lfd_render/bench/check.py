"""Whether a panel image is what it should be, before anyone believes how fast it was made.

Three faults make a technique look fast: it draws nothing, it leaves out a view, or it draws fewer
pixels than it was asked for. Each shows in the panel image alone, or against the standard of a few
views (`bench.gold`):

- An eye sees black where the standard does not.
- Views change little from one to the next, so the mean of each block of the panel is near the mean
  of its neighbours'. One that is not is missing, or left from another frame.
- Rows of half as many pixels come in pairs. What the standard has of difference within pairs of
  rows is absent from such a picture, whatever its other errors: the share of it that the picture
  has is near 1 for whole pictures and near 0 for half ones (0.83 to 1.04, and 0.001, measured).
  Filters move both (0.40 to 0.67, and 0.14 to 0.45), so that filtered pictures are also held
  against others under the same filter.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lfd_render.bench.gold import likeness
from lfd_render.display import DisplayProfile, Rig
from lfd_render.panel.look import look_from

Pixels = NDArray[np.uint8]
_BLOCK = 80  # panel pixels: 400 subpixels of each of 48 views, and several times what depth shifts
_JUMP_LEVELS = 3.0  # noise of a block's mean
_JUMP_TIMES = 5.0  # over the median view's; views of whole frames stay below 2
_LEAST_DETAIL = 0.15
_LEAST_OF_PEERS = 0.75  # of the most detail under the same filter; half pictures have 0.35 to 0.67
_BLACK = 0.02  # of the standard's mean


@dataclass(frozen=True)
class Verdict:
    """fault: what is wrong, or None; rmse (levels of 255) and ssim: means over the eyes' pictures,
    in the box of what the standard shows; detail: share of the standard's differences within pairs
    of rows."""

    fault: str | None
    rmse: float
    ssim: float
    detail: float


@dataclass(frozen=True)
class Standard:
    """Pictures of some views from their own eyes, [y, x, 3] each."""

    views: tuple[int, ...]
    pictures: tuple[Pixels, ...]


def verdict(eia: Pixels, display: DisplayProfile, rig: Rig, standard: Standard) -> Verdict:
    """Judge a panel image. rig: of the views woven in. Raises UsageError without scikit-image."""
    height, width = standard.pictures[0].shape[:2]
    seen = [
        look_from(
            eia,
            display,
            (float(rig.eye_x_mm[view]), 0.0, rig.distance_mm),
            rig.views,
            (width, height),
            sigma_views=0.0,
        )
        for view in standard.views
    ]
    pairs = list(zip(seen, standard.pictures, strict=True))
    close = [likeness(a, b) for a, b in pairs]
    detail = detail_share(seen, standard.pictures)
    fault = None
    black = [v for v, (a, b) in zip(standard.views, pairs, strict=True)
             if a.mean() < _BLACK * b.mean()]  # fmt: skip
    if black:
        fault = f"shows nothing in view {black[0]}"
    elif (view := stray_view(eia, display.phase_tables().view_index_map(rig.views))) is not None:
        fault = f"view {view} is missing, or of another frame"
    elif detail < _LEAST_DETAIL:
        fault = f"has {100 * detail:.0f} % of the detail of its size: fewer rows than asked for"
    rmse, ssim = (float(np.mean(values)) for values in zip(*close, strict=True))
    return Verdict(fault, rmse, ssim, detail)


def against_peers(found: Verdict, peers: list[Verdict]) -> Verdict:
    """A verdict once others' under the same filter and supersampling are known."""
    most = max((peer.detail for peer in peers), default=0.0)
    if found.fault or found.detail >= _LEAST_OF_PEERS * most:
        return found
    share = f"{100 * found.detail:.0f} % of the detail of its size"
    return replace(
        found, fault=f"has {share}, others {100 * most:.0f} %: fewer rows than asked for"
    )


def detail_share(seen: list[Pixels], standard: tuple[Pixels, ...]) -> float:
    """How much of the standard's differences within pairs of rows the pictures have, by least
    squares: 1 for the standard itself, 0 for pictures of half the rows."""
    products = squares = 0.0
    for a, b in zip(seen, standard, strict=True):
        rows = 2 * (len(a) // 2)
        have, want = ((p[0:rows:2].astype(np.float64) - p[1:rows:2]) for p in (a, b))
        products += float((have * want).sum())
        squares += float((want * want).sum())
    return products / squares if squares else 1.0


def stray_view(eia: Pixels, view_map: NDArray[np.uint16]) -> int | None:
    """The view that follows its neighbours least, if it does not; view_map: of each subpixel."""
    views = int(view_map.max()) + 1
    if views < 4:
        return None
    means = _block_means(eia, view_map, views)
    jump = np.empty(views)
    jump[1:-1] = _rms(means[1:-1] - 0.5 * (means[:-2] + means[2:]))
    # A stray view disturbs its neighbours too, by half as much. Ends have one neighbour, and weigh
    # less, so that a stray one is not taken for them.
    jump[0], jump[-1] = (
        0.75 * _rms(means[:1] - means[1:2])[0],
        0.75 * _rms(means[-1:] - means[-2:-1])[0],
    )
    worst = int(np.argmax(jump))
    limit = max(_JUMP_LEVELS, _JUMP_TIMES * float(np.median(jump)))
    return worst if jump[worst] > limit else None


def _rms(differences: NDArray[np.float64]) -> NDArray[np.float64]:
    """Over all but the first axis."""
    found: NDArray[np.float64] = np.sqrt(np.mean(differences.reshape(len(differences), -1) ** 2, 1))
    return found


def _block_means(eia: Pixels, view_map: NDArray[np.uint16], views: int) -> NDArray[np.float64]:
    """Mean code of each view's subpixels in each block and colour, [view, block, colour]."""
    height, width = eia.shape[:2]
    across = -(-width // _BLOCK)
    block = (np.arange(height) // _BLOCK)[:, None] * across + np.arange(width) // _BLOCK
    count = int(block.max()) + 1
    means = np.zeros((views, count, 3))
    for color in range(3):
        bins = (view_map[..., color].astype(np.int64) * count + block).ravel()
        total = np.bincount(bins, eia[..., color].ravel(), views * count)
        number = np.bincount(bins, minlength=views * count)
        means[..., color] = (total / np.maximum(number, 1)).reshape(views, count)
    return means

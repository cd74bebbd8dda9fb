"""Pictures of where two pictures differ."""

import numpy as np
from numpy.typing import NDArray

from lfd_render.quality.metrics import PEAK, check_alike

Pixels = NDArray[np.uint8]


def largest_difference(a: Pixels, b: Pixels) -> int:
    """The largest absolute difference of any channel of any pixel, in levels."""
    check_alike(a, b)
    return int(np.abs(a.astype(np.int16) - b).max())


def difference_picture(a: Pixels, b: Pixels, white: int) -> Pixels:
    """Absolute differences by channel, uint8 [y, x, 3]: 0 is 0, `white` levels and more 255."""
    check_alike(a, b)
    difference = np.abs(a.astype(np.int16) - b)
    levels = np.minimum(np.rint(difference * (PEAK / max(white, 1))), PEAK)
    return np.asarray(levels, np.uint8)

"""FLIP, the difference of two pictures as a person sees it flipping between them."""

import numpy as np
from numpy.typing import NDArray

from lfd_render.errors import UsageError
from lfd_render.quality.metrics import check_alike

Pixels = NDArray[np.uint8]


def flip(reference: Pixels, test: Pixels, pixels_per_degree: float) -> float:
    """Mean LDR-FLIP of two sRGB pictures, 0 to 1 (Andersson et al. 2020).

    Raises UsageError without flip-evaluator, PictureError for pictures of different sizes.
    """
    return _evaluate(reference, test, pixels_per_degree, colored=False)[1]


def flip_picture(reference: Pixels, test: Pixels, pixels_per_degree: float) -> Pixels:
    """Where LDR-FLIP is high, uint8 [y, x, 3] in the colour map magma. Raises as `flip` does."""
    return np.rint(255 * _evaluate(reference, test, pixels_per_degree, colored=True)[0]).astype(
        np.uint8
    )


def _evaluate(
    reference: Pixels, test: Pixels, pixels_per_degree: float, *, colored: bool
) -> tuple[NDArray[np.float32], float]:
    check_alike(reference, test)
    try:
        from flip_evaluator import evaluate  # noqa: PLC0415 - an optional extra
    except ImportError as cause:
        raise UsageError("FLIP needs flip-evaluator; install lfd-render[bench]") from cause
    first, second = (picture.astype(np.float32) / 255.0 for picture in (reference, test))
    options = {"ppd": float(pixels_per_degree)}
    found, mean, _ = evaluate(first, second, "LDR", applyMagma=colored, parameters=options)
    return found, float(mean)

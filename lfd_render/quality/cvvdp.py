"""ColorVideoVDP, the quality of pictures and videos as a person sees it (Mantiuk et al. 2024).

It succeeds HDR-VDP-3, which Gavane and Watson 2024 measure with.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lfd_render.errors import PictureError, UsageError
from lfd_render.quality.metrics import check_alike

Pixels = NDArray[np.uint8]

SCREEN = "standard_4k"  # its luminance, contrast and reflections: 200 cd/m², 1000:1, office light


def cvvdp(
    reference: Sequence[Pixels],
    test: Sequence[Pixels],
    pixels_per_degree: float,
    frames_per_second: float = 30.0,
) -> float:
    """Quality of sRGB pictures in just-objectionable differences: 10 for equal ones.

    One picture each is compared as a still, more as a video. Raises UsageError without cvvdp,
    PictureError for pictures of different sizes or numbers.
    """
    if len(reference) != len(test) or not reference:
        raise PictureError(
            f"videos have {len(reference)} and {len(test)} frames; "
            "they should have as many, one at least"
        )
    for pair in zip(reference, test, strict=True):
        check_alike(reference[0], pair[0])
        check_alike(*pair)
    try:
        import pycvvdp  # noqa: PLC0415 - an optional extra, which brings torch
    except ImportError as cause:
        raise UsageError("ColorVideoVDP needs cvvdp; install lfd-render[cvvdp]") from cause
    height, width = reference[0].shape[:2]
    screen = pycvvdp.vvdp_display_geometry((width, height), ppd=float(pixels_per_degree))
    metric = pycvvdp.cvvdp(display_name=SCREEN, display_geometry=screen, quiet=True)
    still = len(reference) == 1
    quality, _ = metric.predict(
        np.stack(test),
        np.stack(reference),
        dim_order="FHWC",
        frames_per_second=0 if still else float(frames_per_second),
    )
    return float(quality)

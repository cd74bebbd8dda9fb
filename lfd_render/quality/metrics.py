"""Full-reference picture metrics on 8-bit sRGB pixels."""

import math

import numpy as np
from numpy.typing import NDArray

from lfd_render.errors import PictureError, UsageError

Pixels = NDArray[np.uint8]

PEAK = 255.0
SSIM_WINDOW = 11  # pixels, the window of a Gaussian of σ 1.5
_REC709 = np.array([0.2126, 0.7152, 0.0722])


def rmse(a: Pixels, b: Pixels) -> float:
    """Root mean square difference of two pictures in levels, 0 to 255."""
    check_alike(a, b)
    return float(np.sqrt(np.mean((a.astype(np.float64) - b) ** 2)))


def psnr(a: Pixels, b: Pixels) -> float:
    """Peak signal-to-noise ratio in dB, 20·log10(255/RMSE); infinite for equal pictures."""
    error = rmse(a, b)
    return 20 * math.log10(PEAK / error) if error else math.inf


def luma(picture: Pixels) -> NDArray[np.float64]:
    """Rec. 709 luma of sRGB codes [y, x, 3] → [y, x], 0 to 255."""
    _check(picture)
    return np.asarray(picture @ _REC709)


def ssim_luma(a: Pixels, b: Pixels) -> float:
    """Structural similarity of luma, −1 to 1 (Wang et al. 2004: Gaussian σ 1.5, 11 × 11).

    Raises UsageError without scikit-image, PictureError below 11 × 11 pixels.
    """
    check_alike(a, b)
    if min(a.shape[:2]) < SSIM_WINDOW:
        raise PictureError(
            f"SSIM: picture is {a.shape[1]} x {a.shape[0]} pixels; it should be at least "
            f"{SSIM_WINDOW} x {SSIM_WINDOW}"
        )
    try:
        from skimage.metrics import structural_similarity  # noqa: PLC0415 - an optional extra
    except ImportError as cause:
        raise UsageError("SSIM needs scikit-image; install lfd-render[bench]") from cause
    # scikit-image types only part of itself.
    similarity = structural_similarity(  # type: ignore[no-untyped-call]
        luma(a),
        luma(b),
        data_range=PEAK,
        gaussian_weights=True,
        sigma=1.5,
        use_sample_covariance=False,
    )
    return float(similarity)


def _check(picture: Pixels) -> None:
    if picture.dtype != np.uint8 or picture.ndim != 3 or picture.shape[2] != 3 or not picture.size:
        raise PictureError(
            f"picture is {picture.dtype} {list(picture.shape)}; it should be uint8 [y, x, 3]"
        )


def check_alike(a: Pixels, b: Pixels) -> None:
    """Raise PictureError unless both are pictures of one size."""
    _check(a)
    _check(b)
    if a.shape != b.shape:
        raise PictureError(
            f"pictures are {a.shape[1]} x {a.shape[0]} and {b.shape[1]} x {b.shape[0]} pixels; "
            "they should be of one size"
        )

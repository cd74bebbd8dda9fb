"""Measures of how close a picture is to its reference."""

from lfd_render.quality.cvvdp import cvvdp
from lfd_render.quality.difference import difference_picture, largest_difference
from lfd_render.quality.flip import flip, flip_picture
from lfd_render.quality.metrics import luma, psnr, rmse, ssim_luma

__all__ = [
    "cvvdp",
    "difference_picture",
    "flip",
    "flip_picture",
    "largest_difference",
    "luma",
    "psnr",
    "rmse",
    "ssim_luma",
]

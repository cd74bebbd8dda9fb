"""Measures of how close a picture is to its reference."""

from lfd_render.quality.flip import flip
from lfd_render.quality.metrics import luma, psnr, rmse, ssim_luma

__all__ = ["flip", "luma", "psnr", "rmse", "ssim_luma"]

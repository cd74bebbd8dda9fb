"""Measures of how close a picture is to its reference."""

from lfd_render.quality.metrics import luma, psnr, rmse, ssim_luma

__all__ = ["luma", "psnr", "rmse", "ssim_luma"]

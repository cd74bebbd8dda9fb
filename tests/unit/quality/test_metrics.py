"""Metrics on pictures whose answer is known."""

import math
import sys

import numpy as np
import pytest

from lfd_render.errors import PictureError, UsageError
from lfd_render.quality import luma, psnr, rmse, ssim_luma

NOISE = np.random.default_rng(4).integers(0, 256, (24, 32, 3), dtype=np.uint8)


def test_rmse_and_psnr_of_a_known_difference() -> None:
    a = np.full((8, 8, 3), 100, np.uint8)
    b = a.copy()
    b[:4] = 106
    b[4:] = 98
    assert rmse(a, b) == rmse(b, a) == pytest.approx(math.sqrt((36 + 4) / 2))
    assert psnr(a, b) == pytest.approx(20 * math.log10(255 / math.sqrt(20)))
    black, white = np.zeros_like(a), np.full_like(a, 255)
    assert rmse(black, white) == 255  # no wrap of unsigned bytes
    assert psnr(black, white) == 0


def test_equal_pictures() -> None:
    assert rmse(NOISE, NOISE) == 0
    assert psnr(NOISE, NOISE) == math.inf
    assert ssim_luma(NOISE, NOISE) == pytest.approx(1)


def test_luma_is_rec_709() -> None:
    picture = np.array([[[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 255]]], np.uint8)
    assert luma(picture)[0] == pytest.approx(255 * np.array([0.2126, 0.7152, 0.0722, 1]))


def test_ssim_of_two_constants_is_its_luminance_term() -> None:
    a, b = np.full((16, 16, 3), 100, np.uint8), np.full((16, 16, 3), 140, np.uint8)
    c1 = (0.01 * 255) ** 2
    expected = (2 * 100 * 140 + c1) / (100**2 + 140**2 + c1)
    assert ssim_luma(a, b) == pytest.approx(expected, rel=1e-9)


def test_ssim_tells_a_shift_and_a_mirror() -> None:
    assert ssim_luma(NOISE, np.roll(NOISE, 3, axis=1)) < 0.2
    assert ssim_luma(NOISE, NOISE[:, ::-1]) < 0.2


def test_bad_pictures_are_named() -> None:
    with pytest.raises(PictureError, match="32 x 24 and 31 x 24 pixels"):
        rmse(NOISE, NOISE[:, 1:])
    with pytest.raises(PictureError, match=r"picture is float64 \[24, 32, 3\]"):
        psnr(NOISE, NOISE / 255)
    with pytest.raises(PictureError, match=r"picture is uint8 \[24, 32\]"):
        luma(NOISE[..., 0])
    with pytest.raises(PictureError, match="SSIM: picture is 32 x 10 pixels"):
        ssim_luma(NOISE[:10], NOISE[:10])


def test_missing_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "skimage.metrics", None)
    with pytest.raises(UsageError, match=r"install lfd-render\[bench\]"):
        ssim_luma(NOISE, NOISE)

"""Panorama files: formats, what is wrong with bad ones, light kept when they are reduced."""

import os
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from numpy.typing import NDArray

from lfd_render.errors import PictureError, ResourceError
from lfd_render.scene import Environment, LoadLimits


def write(path: Path, pixels: NDArray[np.floating], kind: str = "float") -> Path:
    """A picture file of [y, x, channel]."""
    height, width, channels = pixels.shape
    out = oiio.ImageOutput.create(str(path))
    assert out.open(str(path), oiio.ImageSpec(width, height, channels, kind))
    assert out.write_image(np.ascontiguousarray(pixels, np.float32))
    out.close()
    return path


@pytest.fixture
def light(rng: np.random.Generator) -> NDArray[np.float64]:
    return rng.uniform(0.0, 40.0, (4, 8, 3)).astype(np.float32)


@pytest.mark.parametrize(
    ("name", "kind", "tolerance"),
    [("a.exr", "float", 0.0), ("a.exr", "half", 2.0**-11), ("a.tif", "float", 0.0),
     ("a.hdr", "float", 2.0**-7)],
)  # fmt: skip
def test_formats(
    tmp_path: Path, light: NDArray[np.float64], name: str, kind: str, tolerance: float
) -> None:
    """Half floats and the shared exponents of HDR keep 11 and 8 bits of the largest channel."""
    found = Environment.load(write(tmp_path / name, light, kind))
    assert np.abs(found.pixels - light).max() <= tolerance * light.max()
    assert found.warnings == ()


def test_whole_numbers_are_srgb(tmp_path: Path) -> None:
    grey = np.full((1, 2, 3), 128 / 255)
    found = Environment.load(write(tmp_path / "a.png", grey, "uint8"))
    np.testing.assert_allclose(found.pixels, 0.2158605, rtol=1e-5)


def test_grey_and_alpha(tmp_path: Path, light: NDArray[np.float64]) -> None:
    grey = Environment.load(write(tmp_path / "a.exr", light[..., :1]))
    np.testing.assert_array_equal(grey.pixels, np.repeat(light[..., :1], 3, axis=2))
    alpha = np.concatenate([light, np.full((4, 8, 1), 0.5)], axis=2)
    found = Environment.load(write(tmp_path / "b.exr", alpha))
    np.testing.assert_array_equal(found.pixels, light)


def message(
    path: Path, kind: type[Exception] = PictureError, limits: LoadLimits | None = None
) -> str:
    with pytest.raises(kind) as caught:
        Environment.load(path, limits)
    text = str(caught.value)
    assert text.startswith(f"{path}: ")
    assert text.isprintable()
    assert "; give" in text or ", give" in text
    return text


def test_files_that_are_no_pictures(tmp_path: Path) -> None:
    assert "no such file" in message(tmp_path / "none.exr")
    assert "not a regular file" in message(tmp_path)
    os.mkfifo(tmp_path / "pipe.exr")
    assert "not a regular file" in message(tmp_path / "pipe.exr")
    for name in ("a.exr", "a.hdr", "a.png", "a.txt", "a"):
        (tmp_path / name).write_bytes(b"no picture at all" * 10)
        assert "cannot be read (" in message(tmp_path / name)


def test_a_truncated_picture(tmp_path: Path, rng: np.random.Generator) -> None:
    path = write(tmp_path / "a.exr", rng.uniform(size=(64, 128, 3)))
    path.write_bytes(path.read_bytes()[:20000])
    assert "cannot be read (" in message(path)


@pytest.mark.parametrize("size", [(4, 4), (8, 4), (1, 1), (100, 197)])
def test_pictures_of_another_shape(tmp_path: Path, size: tuple[int, int]) -> None:
    path = write(tmp_path / "a.exr", np.ones((*size, 3)))
    assert f"{size[1]} × {size[0]} pixels; give an equirectangular picture" in message(path)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e20])
def test_radiance_that_is_none(tmp_path: Path, value: float) -> None:
    pixels = np.ones((4, 8, 3))
    pixels[2, 5, 1] = value
    assert "pixel (5, 2) is [1.0, " in message(write(tmp_path / "a.exr", pixels))


def test_negative_radiance_counts_as_none(tmp_path: Path) -> None:
    pixels = np.ones((4, 8, 3))
    pixels[1, 3] = [-0.01, 2.0, 3.0]
    found = Environment.load(write(tmp_path / "a.exr", pixels))
    assert found.pixels[1, 3].tolist() == [0.0, 2.0, 3.0]
    assert found.warnings == (f"{tmp_path}/a.exr: 1 pixels of negative radiance count as 0",)


def test_large_pictures_are_reduced_and_keep_their_light(
    tmp_path: Path, rng: np.random.Generator
) -> None:
    pixels = rng.uniform(0.0, 1.0, (1100, 2200, 3))
    pixels[400, 900] = 1e5
    found = Environment.load(write(tmp_path / "a.exr", pixels))
    assert found.pixels.shape == (1024, 2048, 3)
    assert found.warnings == (f"{tmp_path}/a.exr: 2200 × 1100 pixels are reduced to 2048 columns",)
    np.testing.assert_allclose(found.pixels.mean(axis=(0, 1)), pixels.mean(axis=(0, 1)), rtol=1e-4)


def test_more_pixels_than_allowed(tmp_path: Path) -> None:
    path = write(tmp_path / "a.exr", np.ones((8, 16, 3)))
    assert "the limit is 127" in message(path, ResourceError, LoadLimits(image_pixels=127))

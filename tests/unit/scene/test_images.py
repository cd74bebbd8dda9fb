"""Decoding pictures: every mode to RGBA8, strips, formats by content, limits before decoding."""

import io
import struct
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from PIL import Image as PillowImage

from lfd_render.errors import ResourceError, SceneError
from lfd_render.scene.images import ImageRequest, decode_images
from lfd_render.scene.limits import Budget, LoadLimits


def decode(*pictures: bytes, **limits: int) -> list[np.ndarray]:
    requests = [ImageRequest(str(i), f"slot {i}", lambda p=p: p) for i, p in enumerate(pictures)]
    return [image.pixels for image in decode_images(requests, Budget(LoadLimits(**limits)))]


def encode(picture: PillowImage.Image, kind: str = "PNG", **options: Any) -> bytes:
    stream = io.BytesIO()
    picture.save(stream, kind, **options)
    return stream.getvalue()


@pytest.mark.parametrize(
    ("mode", "color", "expected"),
    [
        ("1", 1, (255, 255, 255, 255)),
        ("L", 7, (7, 7, 7, 255)),
        ("LA", (7, 8), (7, 7, 7, 8)),
        ("RGB", (1, 2, 3), (1, 2, 3, 255)),
        ("RGBA", (1, 2, 3, 0), (1, 2, 3, 0)),
        ("I;16", 0x1234, (0x12, 0x12, 0x12, 255)),
    ],
)
def test_every_mode_becomes_rgba(mode: str, color: Any, expected: tuple[int, ...]) -> None:
    (pixels,) = decode(encode(PillowImage.new(mode, (3, 2), color)))
    assert pixels.shape == (2, 3, 4)
    assert pixels.dtype == np.uint8
    assert (pixels == expected).all()


def test_a_palette_with_a_transparent_entry() -> None:
    picture = PillowImage.new("P", (2, 1))
    picture.putpalette([10, 20, 30, 40, 50, 60])
    picture.putpixel((1, 0), 1)
    (pixels,) = decode(encode(picture, transparency=0))
    np.testing.assert_array_equal(pixels[0], [(10, 20, 30, 0), (40, 50, 60, 255)])


def test_cmyk_jpegs() -> None:
    (pixels,) = decode(encode(PillowImage.new("CMYK", (8, 8), (0, 0, 0, 0)), "JPEG"))
    assert (pixels == 255).all()


@pytest.mark.parametrize("size", [(1, 2_500_000), (1000, 2100), (3000, 701)])
def test_strips_join_without_a_seam(size: tuple[int, int]) -> None:
    width, height = size
    ramp = (np.arange(width * height) % 251).astype(np.uint8).reshape(height, width)
    (pixels,) = decode(encode(PillowImage.fromarray(ramp), compress_level=0))
    np.testing.assert_array_equal(pixels[..., 0], ramp)


def test_pictures_keep_their_order() -> None:
    pictures = [encode(PillowImage.new("L", (64, 64), i)) for i in range(40)]
    assert [p[0, 0, 0] for p in decode(*pictures)] == list(range(40))


def test_of_several_failures_the_first_in_order_is_told() -> None:
    good = encode(PillowImage.new("L", (4, 4)))
    with pytest.raises(SceneError, match=r"^slot 1: "):
        decode(good, b"bad", b"worse")


@pytest.mark.parametrize("kind", ["GIF", "BMP", "TIFF", "PPM", "ICO"])
def test_other_formats_are_refused_by_content(kind: str) -> None:
    with pytest.raises(SceneError, match="give a PNG, JPEG or WebP"):
        decode(encode(PillowImage.new("RGB", (16, 16)), kind))


@pytest.mark.parametrize(
    ("kind", "options"),
    [
        ("PNG", {}),
        ("JPEG", {}),
        ("WEBP", {}),
        ("WEBP", {"lossless": True}),
        ("WEBP", {"exif": b"Exif\0\0II*\0\x08\0\0\0\0\0\0\0\0\0"}),
    ],
)
def test_the_pixel_limit_is_exact(kind: str, options: dict[str, Any]) -> None:
    picture = encode(PillowImage.new("RGB", (30, 21)), kind, **options)
    assert decode(picture, image_pixels=630)[0].shape == (21, 30, 4)
    with pytest.raises(ResourceError, match="30 × 21 pixels; the limit is 629"):
        decode(picture, image_pixels=629)


def test_a_webp_bomb_is_refused_before_its_plugin_makes_room(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def never(stream: object) -> None:
        raise AssertionError("the plugin was called")

    monkeypatch.setattr("PIL.WebPImagePlugin.WebPImageFile", never)
    body = struct.pack("<B3x", 0) + (16_382).to_bytes(3, "little") * 2
    bomb = b"RIFF" + struct.pack("<I", 22) + b"WEBPVP8X" + struct.pack("<I", 10) + body
    with pytest.raises(ResourceError, match="16383 × 16383"):
        decode(bomb, image_pixels=1 << 24)


def test_no_pictures() -> None:
    assert decode() == []


def test_readers_run_once_each() -> None:
    seen: list[int] = []

    def reader(i: int) -> Callable[[], bytes]:
        def read() -> bytes:
            seen.append(i)
            return encode(PillowImage.new("L", (1, 1)))

        return read

    requests = [ImageRequest("", "", reader(i)) for i in range(9)]
    decode_images(requests, Budget(LoadLimits()))
    assert sorted(seen) == list(range(9))

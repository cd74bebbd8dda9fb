"""The PNG writer against other decoders: every pixel, checksum and text entry."""

import io
import struct
import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from PIL import Image

from lfd_render.panel import png
from lfd_render.panel.png import SIGNATURE, png_chunks

Pixels = NDArray[np.uint8]


def decoded(data: bytes) -> tuple[Pixels, dict[str, str]]:
    """Pixels and text as Pillow reads them; it checks each chunk's CRC."""
    with Image.open(io.BytesIO(data)) as image:
        pixels = np.array(image)
        assert image.mode == "RGB"
        return pixels, dict(image.text)  # type: ignore[attr-defined]


def chunks(data: bytes) -> list[tuple[bytes, bytes]]:
    """Kind and data of each chunk; checks signature, lengths and checksums by zlib's."""
    assert data.startswith(SIGNATURE)
    found, at = [], len(SIGNATURE)
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        body = data[at + 8 : at + 8 + length]
        (checksum,) = struct.unpack(">I", data[at + 8 + length : at + 12 + length])
        assert checksum == zlib.crc32(kind + body)
        found.append((kind, body))
        at += 12 + length
    return found


def picture(kind: str, height: int, width: int) -> Pixels:
    rng = np.random.default_rng(height * width)
    match kind:
        case "noise":
            return rng.integers(0, 256, (height, width, 3), dtype=np.uint8)
        case "flat":
            return np.full((height, width, 3), 200, np.uint8)
        case _:
            ramp = np.arange(height * width * 3).reshape(height, width, 3)
            return (ramp // 7 % 256).astype(np.uint8)


@pytest.mark.parametrize("kind", ["noise", "flat", "ramp"])
@pytest.mark.parametrize("strip_bytes", [1, 1000, 3 << 20])
@given(height=st.integers(1, 40), width=st.integers(1, 40))
def test_every_pixel_comes_back(kind: str, strip_bytes: int, height: int, width: int) -> None:
    pixels = picture(kind, height, width)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(png, "_STRIP_BYTES", strip_bytes)
        data = b"".join(png_chunks(pixels))
    np.testing.assert_array_equal(decoded(data)[0], pixels)
    # zlib refuses a stream whose Adler-32 is wrong, which Pillow does not look at.
    stream = b"".join(body for kind, body in chunks(data) if kind == b"IDAT")
    assert len(zlib.decompress(stream)) == height * (1 + 3 * width)


def test_a_panel_is_cut_into_strips_and_is_the_same_on_any_number_of_cores(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pixels = picture("noise", 700, 3000)
    data = {}
    for cores in (1, 2, 5):
        monkeypatch.setattr(png.os, "sched_getaffinity", lambda _, n=cores: set(range(n)))
        data[cores] = b"".join(png_chunks(pixels))
    assert data[1] == data[2] == data[5]
    assert sum(kind == b"IDAT" for kind, _ in chunks(data[1])) == 2 + 2  # and header and checksum
    np.testing.assert_array_equal(decoded(data[1])[0], pixels)


def test_a_wrong_checksum_is_noticed() -> None:
    """The planted fault of the tests above."""
    data = bytearray(b"".join(png_chunks(picture("ramp", 9, 9))))
    *_, (kind, adler), _ = chunks(bytes(data))
    assert (kind, len(adler)) == (b"IDAT", 4)
    stream = [body for kind, body in chunks(bytes(data)) if kind == b"IDAT"]
    stream[-1] = bytes([adler[0] ^ 1]) + adler[1:]
    with pytest.raises(zlib.error, match="incorrect data check"):
        zlib.decompress(b"".join(stream))
    data[-14] ^= 1  # a byte of the last checksum's own CRC
    with pytest.raises(AssertionError):
        chunks(bytes(data))


@given(st.lists(st.binary(min_size=0, max_size=300), min_size=1, max_size=5))
def test_adler_of_joined_parts(parts: list[bytes]) -> None:
    total = 1
    for part in parts:
        total = png._joined_adler(total, zlib.adler32(part), len(part))
    assert total == zlib.adler32(b"".join(parts))


def test_text_of_any_language() -> None:
    text = {"lfd:profile": "gavane", "note": "φ = 0, ½ lens", "Comment": "½ café"}
    data = b"".join(png_chunks(picture("flat", 2, 2), text))
    assert decoded(data)[1] == text
    assert [kind for kind, _ in chunks(data)][1:4] == [b"tEXt", b"iTXt", b"tEXt"]


def test_panel_images_are_not_much_larger_than_pillow_writes_them() -> None:
    """Views of a lens side by side, each a smooth gradient with noise of one level."""
    rng = np.random.default_rng(1)
    y, x = np.mgrid[0:400, 0:960]
    view = (2.0 * x + y) % 16
    light = 120 + 60 * np.sin(x / 90)[..., None] + 3 * view[..., None] * np.array([1, 0.5, 0.2])
    pixels = (light + rng.integers(0, 2, light.shape)).astype(np.uint8)
    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, "PNG", compress_level=1)
    assert sum(map(len, png_chunks(pixels))) < 1.15 * len(buffer.getvalue())

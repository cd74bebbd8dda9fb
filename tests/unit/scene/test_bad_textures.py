"""Bad pictures of a scene: the message names material, slot and file."""

import struct
import zlib
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from lfd_render.errors import ResourceError
from lfd_render.scene import LoadLimits, Scene

Message = Callable[..., str]


def textured(gltf: Any, uri: str) -> None:
    """A triangle whose normal map is the picture at a URI."""
    gltf.append("materials", {"name": "brass", "normalTexture": gltf.texture(uri)})
    gltf.triangle(material=0)


def test_a_missing_texture_names_material_slot_and_file(message: Message, gltf: Any) -> None:
    textured(gltf, "maps/none.png")
    text = message(gltf.write())
    assert text.startswith("material 'brass': normalTexture: images[0].uri: 'maps/none.png': ")
    assert "No such file" in text


@pytest.mark.parametrize(
    "damage",
    [
        lambda data: data[: len(data) // 2],
        lambda data: data[:20],
        lambda data: data[:60] + bytes(20) + data[80:],
        lambda data: b"",
        lambda data: b"GIF89a" + data,
    ],
)
@pytest.mark.parametrize("kind", ["PNG", "JPEG", "WEBP"])
def test_a_damaged_texture(
    message: Message,
    gltf: Any,
    picture_bytes: Callable[..., bytes],
    rng: np.random.Generator,
    kind: str,
    damage: Callable[[bytes], bytes],
) -> None:
    pixels = rng.integers(0, 256, (40, 40, 3), np.uint8)
    whole = picture_bytes(pixels, kind)
    (gltf.folder / "map").write_bytes(damage(whole))
    textured(gltf, "map")
    if kind != "PNG" and len(damage(whole)) == len(whole):
        return  # without checksums, wrong pixels are pixels
    assert "material 'brass': normalTexture: images[0].uri: 'map': " in message(gltf.write())


def png_header(width: int, height: int) -> bytes:
    """A PNG that claims a size and holds a few bytes."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        checked = kind + data
        return struct.pack(">I", len(data)) + checked + struct.pack(">I", zlib.crc32(checked))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    data = zlib.compress(bytes(1000))
    return (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")
    )


def test_a_picture_bomb_is_refused_by_its_header(message: Message, gltf: Any) -> None:
    (gltf.folder / "bomb.png").write_bytes(png_header(100_000, 100_000))
    textured(gltf, "bomb.png")
    assert "100000 × 100000 pixels" in message(gltf.write(), ResourceError)


def test_all_pictures_together_have_a_limit(
    message: Message, gltf: Any, picture_bytes: Callable[..., bytes]
) -> None:
    (gltf.folder / "a.png").write_bytes(picture_bytes(np.zeros((8, 8, 3), np.uint8)))
    materials = [{"normalTexture": gltf.texture("a.png")} for _ in range(3)]
    gltf.json["materials"] = materials
    primitive = gltf.primitive()
    gltf.node(mesh=gltf.mesh(*({**primitive, "material": i} for i in range(3))))
    assert Scene.load(gltf.write(), LoadLimits(texels=192)).triangle_count == 3
    text = message(gltf.write(), ResourceError, texels=191)
    assert "texels: 192 and more; the limit is 191" in text

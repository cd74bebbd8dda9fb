"""Textures on the device: many, large, of many sizes; each is kept or honestly made smaller."""

import dataclasses
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from lfd_render.errors import ResourceError
from lfd_render.gpu import raw as gl
from lfd_render.gpu import textures as device_textures
from lfd_render.gpu.device import Device, DeviceInfo
from lfd_render.gpu.layout import CONSTANTS, TEXTURE_ROLES
from lfd_render.gpu.texture_plan import RESERVED_UNITS, Map, mip_bytes, plan_arrays
from lfd_render.gpu.textures import MaterialTextures
from lfd_render.reference.textures import linear_from_srgb, mip_chain
from lfd_render.scene import Image, Instance, Material, Scene, TextureSlot

from .helpers import examples, mesh_of
from .test_shade import case_of, noise, views

pytestmark = pytest.mark.needs("gl")

WRAPS = [("repeat", "repeat"), ("clamp", "clamp"), ("mirror", "repeat")]


@contextmanager
def limited(device: Device, **limits: int) -> Iterator[None]:
    """The device as one with other limits."""
    info = device.info
    device.info = dataclasses.replace(info, **limits)
    try:
        yield
    finally:
        device.info = info


def materials_of(count: int, wrap: tuple[str, str] = ("repeat", "repeat")) -> tuple[Material, ...]:
    """Unlit materials, each with an image of its own as base colour."""
    slots = (TextureSlot(index, wrap=wrap) for index in range(count))  # type: ignore[arg-type]
    return tuple(Material(str(s.image), unlit=True, base_color_texture=s) for s in slots)


def level_0(textures: MaterialTextures, material: int, role: str) -> NDArray[np.uint8]:
    """The texels that a material's slot leads to, [y, x, 4]."""
    slot = int(textures.slots[material * len(TEXTURE_ROLES) + TEXTURE_ROLES.index(role)])
    group = slot & ((1 << CONSTANTS["SLOT_GROUP_BITS"]) - 1)
    layer = slot >> CONSTANTS["SLOT_GROUP_BITS"] & ((1 << CONSTANTS["SLOT_LAYER_BITS"]) - 1)
    arrays = textures.srgb if role in device_textures.SRGB_ROLES else textures.linear
    texels: NDArray[np.uint8] = arrays[group].read(np.uint8, gl.UNSIGNED_BYTE)[layer]
    return texels


# ---- the plan ---------------------------------------------------------------------------------


def random_maps(rng: np.random.Generator) -> tuple[list[Map], list[tuple[int, int]]]:
    count = int(rng.choice([1, 5, 40, 600]))
    sizes = [(int(w), int(h)) for w, h in np.rint(np.exp2(rng.uniform(0, 11, (count, 2))) + 0.5)]
    maps = {
        Map(int(image), bool(rng.integers(2)), WRAPS[rng.integers(len(WRAPS))])
        for image in rng.integers(0, count, 2 * count)
    }
    return sorted(maps, key=str), sizes


@examples(30)
@given(st.integers(0, 2**32 - 1))
def test_every_texture_finds_a_place_within_the_limits(device: Device, seed: int) -> None:
    rng = np.random.default_rng(seed)
    maps, sizes = random_maps(rng)
    info = dataclasses.replace(
        device.info,
        max_texture_units=int(rng.choice([16, 24, 32])),
        max_texture_size=int(rng.choice([512, 16384])),
        max_array_layers=int(rng.choice([256, 2048])),
        max_texture_bytes=int(rng.choice([1 << 20, 1 << 30])),
        texture_budget_bytes=int(rng.choice([8 << 20, 1 << 33])),
    )
    arrays, warnings = plan_arrays(maps, sizes, ["image"] * len(sizes), info)
    assert sorted((m for a in arrays for m in a.maps), key=str) == maps
    assert len(arrays) <= info.max_texture_units - RESERVED_UNITS
    assert sum(mip_bytes(a.size) * len(a.maps) for a in arrays) <= info.texture_budget_bytes
    changed = False
    for array in arrays:
        assert len({m.family for m in array.maps}) == 1
        assert max(array.size) <= info.max_texture_size
        assert len(array.maps) <= info.max_array_layers
        assert mip_bytes(array.size) * len(array.maps) <= info.max_texture_bytes
        changed |= any(sizes[m.image] != array.size for m in array.maps)
    assert changed == bool(warnings)


def test_sizes_are_kept_where_units_suffice(device: Device) -> None:
    sizes = [(16 * n, 8 * n) for n in range(1, 31)]
    maps = [Map(image, False, WRAPS[0]) for image in range(30)]
    arrays, warnings = plan_arrays(maps, sizes, ["image"] * 30, _units(device.info, 30))
    assert [array.size for array in arrays] == sizes
    assert not warnings


def test_the_most_alike_sizes_are_merged(device: Device) -> None:
    sizes = [(8, 8), (100, 100), (101, 99), (900, 30)]
    maps = [Map(image, True, WRAPS[0]) for image in range(4)]
    arrays, warnings = plan_arrays(maps, sizes, ["image"] * 4, _units(device.info, 3))
    assert [array.size for array in arrays] == [(8, 8), (101, 100), (900, 30)]
    assert warnings == [
        "textures of 2 sizes are enlarged, by up to 1.01 a side: the scene has 4 kinds of size, "
        "wrap and colour space, the device 3 texture units"
    ]


def test_too_many_textures_are_refused_with_their_number(device: Device) -> None:
    maps = [Map(image, True, WRAPS[0]) for image in range(70)]
    info = dataclasses.replace(_units(device.info, 2), max_array_layers=20)
    with pytest.raises(ResourceError, match="70 different ones need 4 arrays of up to 20 layers"):
        plan_arrays(maps, [(4, 4)] * 70, ["image"] * 70, info)


def _units(info: DeviceInfo, units: int) -> DeviceInfo:
    return dataclasses.replace(info, max_texture_units=units + RESERVED_UNITS)


# ---- texels -----------------------------------------------------------------------------------


def test_more_textures_of_one_size_than_an_array_holds(
    device: Device, rng: np.random.Generator
) -> None:
    count = device.info.max_array_layers + 50
    images = [noise(rng, 2, 1) for _ in range(count)]
    textures = MaterialTextures(device, materials_of(count), images)
    assert [array.layers for array in textures.srgb] == [count - 50, 50]
    assert not textures.warnings
    layers = np.concatenate([a.read(np.uint8, gl.UNSIGNED_BYTE) for a in textures.srgb])
    np.testing.assert_array_equal(layers, [image.pixels for image in images])
    textures.release()


@pytest.mark.parametrize("role", ["base_color", "normal"])
@pytest.mark.parametrize("size", [(64, 32), (61, 37), (12, 100)])
def test_a_reduced_texture_is_its_own_mip_level(
    device: Device,
    rng: np.random.Generator,
    monkeypatch: pytest.MonkeyPatch,
    size: tuple[int, int],
    role: str,
) -> None:
    monkeypatch.setattr(device_textures, "_STRIP_TEXELS", 600)
    image = noise(rng, *size)
    material = Material("reduced", **{f"{role}_texture": TextureSlot(0)})  # type: ignore[arg-type]
    most = mip_bytes((size[0] // 4 + 1, size[1] // 4 + 1))
    with limited(device, max_texture_bytes=most):
        textures = MaterialTextures(device, [material], [image])
    found = level_0(textures, 0, role)
    assert found.shape == (size[1] // 4, size[0] // 4, 4)
    (warning,) = textures.warnings
    assert f"1 of 1 textures are reduced, image 'noise' from {size[0]}×{size[1]}" in warning
    textures.release()

    # Odd sizes leave a row or column over, which devices weigh as they like.
    whole = image.pixels[: size[1] // 4 * 4, : size[0] // 4 * 4]
    expected = mip_chain(whole, srgb=role == "base_color")[2]
    linear = found / 255.0
    if role == "base_color":
        linear[..., :3] = linear_from_srgb(linear[..., :3])
    even = size[0] % 4 == 0 and size[1] % 4 == 0
    # Devices cut or round each of two levels to 8 bits: up to two steps of 1/255, in sRGB up to 2.3
    # times that in linear light. For odd sizes 0.17 was measured, 0.036 on average.
    assert np.abs(linear - expected).max() < (2 * 2.3 / 255 if even else 0.35)
    assert np.abs(linear - expected).mean() < (0.008 if even else 0.06)


def test_all_textures_together_keep_to_the_budget(device: Device, rng: np.random.Generator) -> None:
    images = [noise(rng, 64, 64), noise(rng, 64, 64), noise(rng, 8, 8)]
    with limited(device, texture_budget_bytes=mip_bytes((64, 64))):
        before = device.ledger.by_label.get("textures", 0)
        textures = MaterialTextures(device, materials_of(3), images)
        # Beside them the white texel that stands in for linear textures.
        taken = device.ledger.by_label["textures"] - before - 4
    assert taken <= mip_bytes((64, 64))
    assert [level_0(textures, i, "base_color").shape[0] for i in range(3)] == [32, 32, 8]
    assert "2 of 3 textures are reduced" in textures.warnings[0]
    textures.release()


@pytest.mark.parametrize("wrap", WRAPS)
def test_enlarging_in_strips_continues_the_wrap(
    rng: np.random.Generator, wrap: tuple[str, str]
) -> None:
    """A strip of the picture is the same rows of a field of repeated pictures, enlarged whole."""
    from PIL import Image as PilImage  # noqa: PLC0415

    # Pillow weighs colours by alpha, and cuts what Lanczos overshoots between its two passes.
    pixels = rng.integers(80, 176, (9, 13, 4)).astype(np.uint8)
    pixels[..., 3] = 255
    columns = {"clamp": [[0] * 13, np.arange(13), [12] * 13], "repeat": [np.arange(13)] * 3}
    rows = {"clamp": [[0] * 9, np.arange(9), [8] * 9], "repeat": [np.arange(9)] * 3}
    columns["mirror"] = [np.arange(13)[::-1], np.arange(13), np.arange(13)[::-1]]
    field = pixels[np.concatenate(rows[wrap[1]])][:, np.concatenate(columns[wrap[0]])]
    whole = PilImage.fromarray(field).resize((60, 51), PilImage.Resampling.LANCZOS, (13, 9, 26, 18))
    found = [
        device_textures._resized(pixels, (60, 51), slice(top, min(top + 7, 51)), wrap)
        for top in range(0, 51, 7)
    ]
    # Which pass comes first, and rounds first, depends on a strip's shape: a step of 8 bits each.
    off = np.concatenate(found).astype(int) - np.asarray(whole)
    assert np.abs(off).max() <= 2


def test_clear_texels_keep_their_colours_when_enlarged() -> None:
    pixels = np.zeros((4, 4, 4), np.uint8)
    pixels[..., :3] = 10, 200, 90
    found = device_textures._resized(pixels, (7, 9), slice(0, 9), ("repeat", "repeat"))
    assert (found == [10, 200, 90, 0]).all()


def test_forty_sizes_and_many_layers_are_drawn_right(
    device: Device, rng: np.random.Generator
) -> None:
    """More kinds than units: what is enlarged looks as the picture itself, magnified."""
    count = 40
    sizes = [(10 + index, 50 - index) for index in range(count)]
    images = tuple(_waves(rng, *size) for size in sizes)
    meshes, instances = [], []
    for index in range(count):
        at = [24.0 * (index % 8) - 96, 24.0 * (index // 8) - 60, 0]
        triangle = np.array([[[0.0, 0, 0], [23, 0, 0], [0, 23, 0]]]) + at
        uv = np.repeat(np.array([[[[0.1, 0.1]], [[0.4, 0.1]], [[0.1, 0.4]]]]), 2, axis=2)
        meshes.append(mesh_of(triangle, index, texcoords=uv))
        instances.append(Instance(str(index), index, np.eye(4)))
    scene = Scene("sizes", tuple(meshes), tuple(instances), materials_of(count), images)
    with limited(device, max_array_layers=2):
        with pytest.raises(ResourceError):  # 30 units of two layers hold no 70 textures
            MaterialTextures(device, materials_of(70), [noise(rng, 2, 2) for _ in range(70)])
        case = case_of(device, scene, *views(256, 144, 1))
    assert len(np.unique(case.solid.ids)) == count + 1
    # Lanczos against bilinear interpolation of smooth pictures; 0.0053 measured.
    assert case.error().max() < 0.015


def _waves(rng: np.random.Generator, width: int, height: int) -> Image:
    """A smooth picture that repeats, different from the others by its phases."""
    y, x = (np.mgrid[:height, :width] + 0.5) / np.array([height, width])[:, None, None]
    phases = rng.uniform(0, 2 * np.pi, (4, 2))
    waves = [np.sin(2 * np.pi * x + a) * np.cos(2 * np.pi * y + b) for a, b in phases]
    return Image("waves", np.rint(150.0 + 60.0 * np.stack(waves, axis=-1)).astype(np.uint8))

"""Material textures on the device: 2D arrays grouped by colour space, size and wrap.

Sampler indices must be the same for all lanes, so textures share arrays and a shader selects among
few of them. sRGB formats let the device filter in linear light.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from PIL import Image as PilImage

from lfd_render.gpu import raw as gl
from lfd_render.gpu.layout import CONSTANTS, TEXTURE_ROLES, dtype
from lfd_render.gpu.memory import TextureArray
from lfd_render.scene import Image, Material, TextureSlot

if TYPE_CHECKING:
    from lfd_render.gpu.device import Device

SRGB_ROLES = ("base_color", "emissive")
_RESERVED_UNITS = 2  # view images and the panel image
_Key = tuple[bool, int, int, str, str]  # sRGB, width, height, wrap s, wrap t


class MaterialTextures:
    """The arrays of both colour spaces, and the slot table that points into them.

    slots: a word each [material × role]; uv_transforms: UvTransform [material × role]. srgb,
    linear: never empty, since GLSL has no arrays of no samplers; a white texel stands in.
    """

    def __init__(
        self, device: Device, materials: Sequence[Material], images: Sequence[Image]
    ) -> None:
        self.warnings: list[str] = []
        self._device = device
        self._images = images
        self._placed: dict[tuple[int, _Key], tuple[int, int]] = {}
        self._layers: dict[_Key, list[int]] = {}
        uses = [
            (row * len(TEXTURE_ROLES) + column, role in SRGB_ROLES, slot)
            for row, material in enumerate(materials)
            for column, role in enumerate(TEXTURE_ROLES)
            if (slot := getattr(material, f"{role}_texture")) is not None
        ]
        keys = self._fit_units([self._key(srgb, slot) for _, srgb, slot in uses])
        count = len(materials) * len(TEXTURE_ROLES)
        self.slots = np.full(count, CONSTANTS["NO_TEXTURE"], np.uint32)
        self.uv_transforms = np.zeros(count, dtype("UvTransform"))
        self.uv_transforms["matrix"] = (1.0, 0.0, 0.0, 1.0)
        for (index, _, slot), key in zip(uses, keys, strict=True):
            self._place(index, slot, key)
        self.srgb = self._upload(srgb=True)
        self.linear = self._upload(srgb=False)

    def _key(self, srgb: bool, slot: TextureSlot) -> _Key:
        height, width = self._images[slot.image].pixels.shape[:2]
        limit = self._device.info.max_texture_size
        if max(width, height) > limit:
            self.warnings.append(
                f"image '{self._images[slot.image].name}': {width}×{height} exceeds the device's "
                f"{limit} texels and is reduced"
            )
            scale = limit / max(width, height)
            width, height = max(1, int(width * scale)), max(1, int(height * scale))
        return srgb, width, height, *slot.wrap

    def _fit_units(self, keys: list[_Key]) -> list[_Key]:
        """Merge the rarest groups into like ones until the device's texture units suffice."""
        merged = list(keys)
        units = self._device.info.max_texture_units - _RESERVED_UNITS
        while len(set(merged)) > units:
            counts = {key: merged.count(key) for key in merged}
            rarest = min(counts, key=lambda key: counts[key])
            alike = [
                k for k in counts if k != rarest and (k[0], *k[3:]) == (rarest[0], *rarest[3:])
            ]
            if not alike:
                break
            area = rarest[1] * rarest[2]
            into = min(alike, key=lambda k: (k[1] * k[2] < area, abs(k[1] * k[2] - area)))
            merged = [into if key == rarest else key for key in merged]
            self.warnings.append(
                f"textures of {rarest[1]}×{rarest[2]} are resampled to {into[1]}×{into[2]}: the "
                f"scene has more kinds of textures than the device's {units} units"
            )
        return merged

    def _place(self, index: int, slot: TextureSlot, key: _Key) -> None:
        """Give a slot its group and layer; the same image in the same group is stored once."""
        layers = self._layers.setdefault(key, [])
        if (slot.image, key) not in self._placed:
            groups = [k for k in self._layers if k[0] == key[0]]
            self._placed[slot.image, key] = (groups.index(key), len(layers))
            layers.append(slot.image)
        group, layer = self._placed[slot.image, key]
        group_bits, layer_bits = CONSTANTS["SLOT_GROUP_BITS"], CONSTANTS["SLOT_LAYER_BITS"]
        self.slots[index] = group | layer << group_bits | slot.texcoord << (group_bits + layer_bits)
        if slot.uv_transform is not None:
            self.uv_transforms[index]["matrix"] = slot.uv_transform[:2, :2].T.reshape(4)
            self.uv_transforms[index]["offset"] = slot.uv_transform[:2, 2]

    def _upload(self, *, srgb: bool) -> list[TextureArray]:
        groups = {key: layers for key, layers in self._layers.items() if key[0] == srgb}
        if not groups:
            groups = {(srgb, 1, 1, "repeat", "repeat"): []}
        return [self._array(key, layers) for key, layers in groups.items()]

    def _array(self, key: _Key, layers: list[int]) -> TextureArray:
        srgb, width, height, *wrap = key
        levels = max(width, height).bit_length()
        size = (width, height, max(1, len(layers)))
        array = TextureArray(
            self._device, "textures", size, gl.SRGB8_ALPHA8 if srgb else gl.RGBA8, levels=levels
        )
        for layer, image in enumerate(layers):
            array.upload(layer, _resized(self._images[image].pixels, width, height))
        if not layers:
            array.upload(0, np.full((1, 1, 4), 255, np.uint8))
        array.generate_mipmaps()
        array.parameters(gl.LINEAR_MIPMAP_LINEAR, gl.LINEAR, wrap)
        return array

    def release(self) -> None:
        """Free all arrays."""
        for array in (*self.srgb, *self.linear):
            array.release()


def _resized(pixels: NDArray[np.uint8], width: int, height: int) -> NDArray[np.uint8]:
    if pixels.shape[:2] == (height, width):
        return pixels
    picture = PilImage.fromarray(pixels).resize((width, height), PilImage.Resampling.LANCZOS)
    return np.asarray(picture)

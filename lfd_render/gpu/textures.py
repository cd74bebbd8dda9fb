"""Material textures on the device: 2D arrays grouped by colour space, size and wrap.

Sampler indices must be the same for all lanes, so textures share arrays and a shader selects among
few of them. sRGB formats let the device filter in linear light.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from PIL import Image as PilImage

from lfd_render.gpu import raw as gl
from lfd_render.gpu.layout import CONSTANTS, TEXTURE_ROLES, dtype
from lfd_render.gpu.memory import TextureArray
from lfd_render.gpu.texture_plan import ArrayPlan, Map, plan_arrays
from lfd_render.scene import Image, Material, TextureSlot

if TYPE_CHECKING:
    from lfd_render.gpu.device import Device

SRGB_ROLES = ("base_color", "emissive")
_STRIP_TEXELS = 1 << 22  # worked on at once: 16 MiB, however large a picture is
_LANCZOS_TEXELS = 3  # reach of the filter, in texels of the smaller picture


class MaterialTextures:
    """The arrays of both colour spaces, and the slot table that points into them.

    slots: a word each [material × role]; uv_transforms: UvTransform [material × role]. srgb,
    linear: never empty, since GLSL has no arrays of no samplers; a white texel stands in.
    """

    def __init__(
        self, device: Device, materials: Sequence[Material], images: Sequence[Image]
    ) -> None:
        self._device = device
        self._images = images
        uses = [
            (
                row * len(TEXTURE_ROLES) + column,
                slot,
                Map(slot.image, role in SRGB_ROLES, slot.wrap),
            )
            for row, material in enumerate(materials)
            for column, role in enumerate(TEXTURE_ROLES)
            if (slot := getattr(material, f"{role}_texture")) is not None
        ]
        arrays, self.warnings = plan_arrays(
            list(dict.fromkeys(one for _, _, one in uses)),
            [image.pixels.shape[1::-1] for image in images],
            [image.name for image in images],
            device.info,
        )
        count = len(materials) * len(TEXTURE_ROLES)
        self.slots = np.full(count, CONSTANTS["NO_TEXTURE"], np.uint32)
        self.uv_transforms = np.zeros(count, dtype("UvTransform"))
        self.uv_transforms["matrix"] = (1.0, 0.0, 0.0, 1.0)
        self.srgb, places = self._upload([a for a in arrays if a.maps[0].srgb], gl.SRGB8_ALPHA8)
        self.linear, others = self._upload([a for a in arrays if not a.maps[0].srgb], gl.RGBA8)
        places |= others
        for index, slot, one in uses:
            self._point(index, slot, places[one])

    def _point(self, index: int, slot: TextureSlot, place: tuple[int, int]) -> None:
        """Write a slot's words: where its texture lies, and how its coordinates are moved."""
        group, layer = place
        group_bits, layer_bits = CONSTANTS["SLOT_GROUP_BITS"], CONSTANTS["SLOT_LAYER_BITS"]
        self.slots[index] = group | layer << group_bits | slot.texcoord << (group_bits + layer_bits)
        if slot.uv_transform is not None:
            self.uv_transforms[index]["matrix"] = slot.uv_transform[:2, :2].T.reshape(4)
            self.uv_transforms[index]["offset"] = slot.uv_transform[:2, 2]

    def _upload(
        self, plans: Sequence[ArrayPlan], internal_format: int
    ) -> tuple[list[TextureArray], dict[Map, tuple[int, int]]]:
        """The arrays of one colour space, and each map's (array, layer)."""
        places = {
            one: (group, layer)
            for group, plan in enumerate(plans)
            for layer, one in enumerate(plan.maps)
        }
        if not plans:
            white = self._array((1, 1, 1), ("repeat", "repeat"), internal_format)
            white.upload(0, np.full((1, 1, 4), 255, np.uint8))
            return [white], places
        return [self._filled(plan, internal_format) for plan in plans], places

    def _filled(self, plan: ArrayPlan, internal_format: int) -> TextureArray:
        array = self._array((*plan.size, len(plan.maps)), plan.maps[0].wrap, internal_format)
        for layer, one in enumerate(plan.maps):
            self._fill(array, layer, one)
        array.generate_mipmaps()
        return array

    def _array(
        self, size: tuple[int, int, int], wrap: tuple[str, str], internal_format: int
    ) -> TextureArray:
        levels = max(size[:2]).bit_length()
        array = TextureArray(self._device, "textures", size, internal_format, levels=levels)
        array.parameters(gl.LINEAR_MIPMAP_LINEAR, gl.LINEAR, wrap)
        return array

    def _fill(self, array: TextureArray, layer: int, one: Map) -> None:
        """Set a layer from an image, at the layer's size, strip by strip."""
        pixels = self._images[one.image].pixels
        height, width = pixels.shape[:2]
        halvings = _halvings((width, height), (array.width, array.height))
        if halvings == 0:
            for rows in _strips(height, width):
                array.upload(layer, pixels[rows], rows.start)
        elif halvings is not None:
            self._fill_halved(array, layer, pixels, halvings)
        else:
            for rows in _strips(array.height, max(width, array.width)):
                strip = _resized(pixels, (array.width, array.height), rows, one.wrap)
                array.upload(layer, strip, rows.start)

    def _fill_halved(
        self, array: TextureArray, layer: int, pixels: NDArray[np.uint8], halvings: int
    ) -> None:
        """The same by the device, as it makes mip levels: sRGB is averaged in linear light."""
        width = pixels.shape[1]
        for rows in _strips(array.height, width << halvings):
            source = pixels[rows.start << halvings : rows.stop << halvings]
            size = (width, len(source), 1)
            strip = TextureArray(
                self._device, "textures", size, array.internal_format, levels=halvings + 1
            )
            strip.upload(0, source)
            strip.generate_mipmaps()
            array.copy_level(strip, halvings, layer, rows.start)
            strip.release()

    def release(self) -> None:
        """Free all arrays."""
        for array in (*self.srgb, *self.linear):
            array.release()


def _strips(height: int, width: int) -> Iterator[slice]:
    """All rows, in slices of few enough texels."""
    step = max(1, _STRIP_TEXELS // width)
    return (slice(top, min(top + step, height)) for top in range(0, height, step))


def _halvings(size: tuple[int, int], into: tuple[int, int]) -> int | None:
    """How often both sides of a size are halved to give another; None if that does not."""
    for halvings in range(max(size).bit_length()):
        if (max(1, size[0] >> halvings), max(1, size[1] >> halvings)) == into:
            return halvings
    return None


def _resized(
    pixels: NDArray[np.uint8], size: tuple[int, int], rows: slice, wrap: tuple[str, str]
) -> NDArray[np.uint8]:
    """Rows of a picture resampled to a size, beyond its edges continued as it wraps."""
    height, width = pixels.shape[:2]
    across, down = width / size[0], height / size[1]
    margin = int(np.ceil(_LANCZOS_TEXELS * max(across, down, 1.0)))
    top, bottom = int(rows.start * down) - margin, int(np.ceil(rows.stop * down)) + margin
    y = _wrapped(np.arange(top, bottom), height, wrap[1])
    x = _wrapped(np.arange(-margin, width + margin), width, wrap[0])
    source = np.ascontiguousarray(pixels[y][:, x])
    # RGBX: as RGBA, Pillow would weigh colours by alpha and lose those of clear texels.
    picture = PilImage.frombuffer("RGBX", (len(x), len(y)), source, "raw", "RGBX", 0, 1)
    box = (margin, rows.start * down - top, margin + width, rows.stop * down - top)
    into = (size[0], rows.stop - rows.start)
    return np.asarray(picture.resize(into, PilImage.Resampling.LANCZOS, box))


def _wrapped(index: NDArray[np.int64], count: int, wrap: str) -> NDArray[np.int64]:
    """Texel indices brought inside a picture, as OpenGL wraps them."""
    if wrap == "clamp":
        return np.clip(index, 0, count - 1)
    if wrap == "repeat":
        return index % count
    folded = index % (2 * count)
    return np.where(folded < count, folded, 2 * count - 1 - folded)

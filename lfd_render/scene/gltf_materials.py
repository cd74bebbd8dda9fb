"""Materials of a glTF file, and which pictures they need."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lfd_render.scene.fields import Fields
from lfd_render.scene.gltf_accessors import Accessors
from lfd_render.scene.gltf_document import Document
from lfd_render.scene.images import ImageRequest, decode_images
from lfd_render.scene.model import AlphaMode, Image, Material, TextureSlot, Wrap

_WRAPS: dict[int, Wrap] = {10497: "repeat", 33071: "clamp", 33648: "mirror"}
_ALPHA: dict[str, AlphaMode] = {"OPAQUE": "opaque", "MASK": "mask", "BLEND": "blend"}


class Materials:
    """Reads materials on demand; only pictures that a read material uses are decoded."""

    def __init__(self, document: Document, accessors: Accessors) -> None:
        self._document = document
        self._accessors = accessors
        self._order: dict[int | None, int] = {}
        self._materials: list[Material] = []
        self._images: dict[int, int] = {}
        self._requests: list[ImageRequest] = []

    def place(self, index: int | None) -> int:
        """Position in the scene of a material of the file; None is glTF's default material."""
        if index not in self._order:
            self._order[index] = len(self._materials)
            self._materials.append(Material("default") if index is None else self._material(index))
        return self._order[index]

    def materials(self) -> tuple[Material, ...]:
        """All materials that were asked for."""
        return tuple(self._materials)

    def decode(self) -> tuple[Image, ...]:
        """The pictures of these materials."""
        return decode_images(self._requests, self._document.budget)

    def _material(self, index: int) -> Material:
        fields = self._document.materials[index]
        name = fields.text("name", f"material {index}")
        pbr = fields.optional("pbrMetallicRoughness") or Fields({}, "")
        red, green, blue, alpha = self._factors(pbr, "baseColorFactor", (1.0, 1.0, 1.0, 1.0))
        return Material(
            name=name,
            base_color=(red, green, blue, alpha),
            metallic=self._factors(pbr, "metallicFactor", 1.0)[0],
            roughness=self._factors(pbr, "roughnessFactor", 1.0)[0],
            emissive=self._emissive(fields),
            alpha_mode=_ALPHA[fields.choice("alphaMode", tuple(_ALPHA), "OPAQUE")],
            alpha_cutoff=fields.number("alphaCutoff", 0.5, low=0.0),
            double_sided=fields.flag("doubleSided"),
            unlit=fields.extension("KHR_materials_unlit") is not None,
            base_color_texture=self._slot(pbr, "baseColorTexture", name),
            metallic_roughness_texture=self._slot(pbr, "metallicRoughnessTexture", name),
            normal_texture=self._slot(fields, "normalTexture", name, "scale"),
            occlusion_texture=self._slot(fields, "occlusionTexture", name, "strength"),
            emissive_texture=self._slot(fields, "emissiveTexture", name),
        )

    def _factors(
        self, fields: Fields, key: str, default: float | Sequence[float]
    ) -> tuple[float, ...]:
        """Factors in 0…1; files that stray outside are clamped with a warning."""
        if isinstance(default, float):
            values: tuple[float, ...] = (fields.number(key, default),)
        else:
            values = fields.numbers(key, default)
        clamped = tuple(min(max(v, 0.0), 1.0) for v in values)
        if clamped != values:
            self._document.warn(f"{fields.place(key)}: {list(values)} clamped to 0…1")
        return clamped

    def _emissive(self, fields: Fields) -> tuple[float, float, float]:
        red, green, blue = self._factors(fields, "emissiveFactor", (0.0, 0.0, 0.0))
        extension = fields.extension("KHR_materials_emissive_strength")
        strength = extension.number("emissiveStrength", 1.0, low=0.0) if extension else 1.0
        return red * strength, green * strength, blue * strength

    def _slot(
        self, owner: Fields, key: str, material: str, scale_key: str | None = None
    ) -> TextureSlot | None:
        info = owner.optional(key)
        if info is None:
            return None
        texture = info.index("index", len(self._document.textures))
        if texture is None:
            info.fail("index", "give the index of a texture")
        image = self._image(self._document.textures[texture], f"material '{material}': {key}")
        if image is None:
            return None
        transform = info.extension("KHR_texture_transform") or Fields({}, "")
        return TextureSlot(
            image=image,
            texcoord=transform.integer("texCoord", info.integer("texCoord", 0, high=1), high=1),
            wrap=self._wrap(self._document.textures[texture]),
            scale=info.number(scale_key, 1.0) if scale_key else 1.0,
            uv_transform=_uv_transform(transform) if transform.path else None,
        )

    def _wrap(self, texture: Fields) -> tuple[Wrap, Wrap]:
        index = texture.index("sampler", len(self._document.samplers))
        sampler = Fields({}, "") if index is None else self._document.samplers[index]
        modes: list[Wrap] = []
        for key in ("wrapS", "wrapT"):
            code = sampler.integer(key, 10497)
            if code not in _WRAPS:
                sampler.fail(key, f"give one of {', '.join(map(str, _WRAPS))}")
            modes.append(_WRAPS[code])
        return modes[0], modes[1]

    def _image(self, texture: Fields, label: str) -> int | None:
        """Position of a texture's picture in the scene; None, with a warning, if it has none."""
        source = texture.extension("EXT_texture_webp") or texture
        index = source.index("source", len(self._document.images))
        if index is None:
            self._document.warn(f"{texture.path}.source: missing; {label} is left out")
            return None
        if index not in self._images:
            self._images[index] = len(self._requests)
            self._requests.append(self._request(index, label))
        return self._images[index]

    def _request(self, index: int, label: str) -> ImageRequest:
        fields = self._document.images[index]
        if "uri" in fields:
            uri = fields.text("uri")
            shown = "data URI" if uri.startswith("data:") else uri
            where = f"{label}: {fields.path}.uri"
            return ImageRequest(
                fields.text("name", shown),
                f"{where}: '{shown[:60]}'",
                lambda: self._document.files.read(uri, where),
            )
        view = fields.index("bufferView", len(self._document.buffer_views))
        if view is None:
            fields.fail("uri", "give a uri or a bufferView")
        # Buffers are read here, in one thread, since several pictures share one.
        data = self._accessors.view_bytes(view)
        name = fields.text("name", f"image {index}")
        return ImageRequest(name, f"{label}: {fields.path}", lambda: bytes(data))


def _uv_transform(fields: Fields) -> NDArray[np.float64]:
    """translation · rotation · scale of KHR_texture_transform, [3, 3].

    Rotation is counter-clockwise as seen in the picture, where v runs down.
    """
    offset_u, offset_v = fields.numbers("offset", (0.0, 0.0))
    scale_u, scale_v = fields.numbers("scale", (1.0, 1.0))
    angle_rad = fields.number("rotation", 0.0)
    cos, sin = math.cos(angle_rad), math.sin(angle_rad)
    return np.array(
        [
            [cos * scale_u, sin * scale_v, offset_u],
            [-sin * scale_u, cos * scale_v, offset_v],
            [0.0, 0.0, 1.0],
        ]
    )

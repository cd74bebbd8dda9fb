"""Materials of glTF files: maps, factors, samplers, extensions, against hand-built files."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from lfd_render.scene import Scene


def test_materials(gltf: Any, picture_bytes: Callable[..., bytes]) -> None:
    red = np.zeros((2, 3, 3), np.uint8)
    red[..., 0] = 200
    (gltf.folder / "red.png").write_bytes(picture_bytes(red))
    (gltf.folder / "red.jpg").write_bytes(picture_bytes(red, "JPEG"))
    (gltf.folder / "red.webp").write_bytes(picture_bytes(red, "WEBP", lossless=True))
    color = gltf.texture("red.png")
    normal = gltf.texture("red.jpg") | {"scale": 0.25, "texCoord": 1}
    gltf.json["textures"][0]["sampler"] = 0
    gltf.append("samplers", {"wrapS": 33071, "wrapT": 33648})
    transform = {"offset": [0, 1], "rotation": math.pi / 2, "scale": [0.5, 0.5], "texCoord": 1}
    webp = {"index": gltf.append("textures", {"extensions": {"EXT_texture_webp": {"source": 2}}})}
    gltf.append("images", {"uri": "red.webp"})
    gltf.append(
        "materials",
        {
            "name": "all",
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.1, 0.2, 0.3, 0.4],
                "metallicFactor": 0.5,
                "roughnessFactor": 0.6,
                "baseColorTexture": color | {"extensions": {"KHR_texture_transform": transform}},
                "metallicRoughnessTexture": color,
            },
            "normalTexture": normal,
            "occlusionTexture": color | {"strength": 0.75},
            "emissiveTexture": webp,
            "emissiveFactor": [1, 0.5, 0],
            "alphaMode": "MASK",
            "alphaCutoff": 0.3,
            "doubleSided": True,
            "extensions": {
                "KHR_materials_unlit": {},
                "KHR_materials_emissive_strength": {"emissiveStrength": 4},
            },
        },
    )
    gltf.triangle(material=0)
    scene = Scene.load(gltf.write())
    (material,) = scene.materials
    assert material.base_color == (0.1, 0.2, 0.3, 0.4)
    assert (material.metallic, material.roughness) == (0.5, 0.6)
    assert material.emissive == (4, 2, 0)
    assert (material.alpha_mode, material.alpha_cutoff) == ("mask", 0.3)
    assert material.double_sided
    assert material.unlit
    slot = material.base_color_texture
    assert slot is not None
    assert slot.uv_transform is not None
    assert (slot.image, slot.texcoord, slot.wrap) == (0, 1, ("clamp", "mirror"))
    # The extension's own example: this is the lower left quadrant of the picture.
    uv = slot.uv_transform @ np.array([[0, 1, 0, 1], [0, 0, 1, 1], [1, 1, 1, 1]])
    np.testing.assert_allclose((uv[0].min(), uv[0].max()), (0, 0.5), atol=1e-12)
    np.testing.assert_allclose((uv[1].min(), uv[1].max()), (0.5, 1), atol=1e-12)
    assert material.normal_texture is not None
    assert (material.normal_texture.scale, material.normal_texture.texcoord) == (0.25, 1)
    assert material.occlusion_texture is not None
    assert material.occlusion_texture.scale == 0.75
    assert len(scene.images) == 3
    np.testing.assert_array_equal(scene.images[0].pixels[0, 0], (200, 0, 0, 255))
    np.testing.assert_array_equal(scene.images[2].pixels[0, 0], (200, 0, 0, 255))


def test_materials_and_pictures_that_nothing_uses_are_not_read(gltf: Any) -> None:
    gltf.append("materials", {"normalTexture": gltf.texture("missing.png")})
    gltf.triangle()
    scene = Scene.load(gltf.write())
    assert scene.images == ()
    assert [m.name for m in scene.materials] == ["default"]


def test_factors_outside_their_range_are_clamped(gltf: Any) -> None:
    gltf.append("materials", {"pbrMetallicRoughness": {"roughnessFactor": 1.25}})
    gltf.triangle(material=0)
    scene = Scene.load(gltf.write())
    assert scene.materials[0].roughness == 1.0
    assert scene.warnings == (
        "materials[0].pbrMetallicRoughness.roughnessFactor: [1.25] clamped to 0…1",
    )


def test_many_materials_load_in_step(gltf: Any) -> None:
    count = 5000
    primitive = gltf.primitive()
    gltf.json["materials"] = [{"name": str(i), "alphaCutoff": i} for i in range(count)]
    gltf.node(mesh=gltf.mesh(*({**primitive, "material": i} for i in range(count))))
    scene = Scene.load(gltf.write())
    assert [m.alpha_cutoff for m in scene.materials] == list(range(count))

"""Golden facts of the real models: counts, sizes, maps, and where their surfaces are."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from lfd_render.scene import Scene


@dataclass(frozen=True)
class Facts:
    triangles: int
    meshes: int
    materials: int
    images: int
    low: tuple[float, float, float]
    high: tuple[float, float, float]


FACTS = {
    "FlightHelmet/FlightHelmet.gltf": Facts(
        94_722, 6, 6, 15, (-0.203643, -0.000021, -0.171546), (0.162941, 0.716000, 0.200029)
    ),
    "animated/Fox.glb": Facts(
        576, 1, 1, 1, (-12.592718, -0.121743, -88.095), (12.592718, 78.907187, 66.624641)
    ),
    "animated/MorphStressTest.gltf": Facts(2_412, 2, 2, 3, (-2, -0.1, -0.5), (2, 0.5, 0.5)),
    "animated/SimpleSkin.gltf": Facts(8, 1, 1, 0, (-0.5, 0, 0), (0.5, 2, 0)),
    "static/CornellBox.glb": Facts(36, 6, 5, 0, (-556, 0, -559.2), (0, 548.8, 0)),
    "static/gltf_primitives.glb": Facts(12, 4, 4, 0, (-1, -1, -1), (1, 1, 1)),
}


@pytest.mark.parametrize("name", FACTS)
def test_counts_and_bounds(assets: Path, name: str) -> None:
    scene = Scene.load(assets / name)
    facts = FACTS[name]
    counts = (scene.triangle_count, len(scene.meshes), len(scene.materials), len(scene.images))
    assert counts == (facts.triangles, facts.meshes, facts.materials, facts.images)
    low, high = scene.bounds()
    size = max(np.subtract(facts.high, facts.low))
    np.testing.assert_allclose(low, facts.low, atol=1e-4 * size)
    np.testing.assert_allclose(high, facts.high, atol=1e-4 * size)
    for mesh in scene.meshes:
        np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1, atol=1e-5)


def test_the_helmet_has_its_maps(assets: Path) -> None:
    scene = Scene.load(assets / "FlightHelmet/FlightHelmet.gltf")
    for material in scene.materials:
        assert material.base_color_texture is not None
        assert material.normal_texture is not None
        assert material.metallic_roughness_texture is not None
        assert material.occlusion_texture is not None
    names = {m.name for m in scene.materials}
    assert {"HoseMat", "RubberWoodMat", "LensesMat"} <= names
    assert all(image.pixels.shape[2] == 4 for image in scene.images)
    assert scene.warnings == ()


def test_the_normals_of_the_helmet_agree_with_its_winding(assets: Path) -> None:
    for mesh in Scene.load(assets / "FlightHelmet/FlightHelmet.gltf").meshes:
        corner = mesh.positions[mesh.triangles].astype(np.float64)
        face = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        agree = np.einsum("mc,mc->m", face, mesh.normals[mesh.triangles].sum(axis=1)) > 0
        assert agree.mean() > 0.98, mesh.name


def test_animated_models_say_that_they_stand_still(assets: Path) -> None:
    scene = Scene.load(assets / "animated/Fox.glb")
    assert scene.warnings == ("animations: not played; the scene stands in its rest pose",)

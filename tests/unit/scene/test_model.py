"""What the scene's dataclasses promise: checked, frozen, counted, bounded."""

from dataclasses import FrozenInstanceError, replace
from typing import Any

import numpy as np
import pytest

from lfd_render.errors import SceneError
from lfd_render.scene import Image, Instance, Material, Mesh, Scene, SceneCamera, TextureSlot


def triangle(**changes: Any) -> Mesh:
    fields: dict[str, Any] = {
        "name": "leaf",
        "positions": np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32),
        "normals": np.tile(np.array([0, 0, 1], np.float32), (3, 1)),
        "texcoords": np.zeros((3, 2, 2), np.float32),
        "colors": np.ones((3, 4), np.float32),
        "triangles": np.array([[0, 1, 2]], np.uint32),
        "material": 0,
    }
    return Mesh(**fields | changes)


def scene(**changes: Any) -> Scene:
    fields: dict[str, Any] = {
        "name": "one",
        "meshes": (triangle(),),
        "instances": (Instance("one", 0, np.eye(4)),),
        "materials": (Material("plain"),),
    }
    return Scene(**fields | changes)


@pytest.mark.parametrize(
    ("field", "value", "expected"),
    [
        ("positions", np.zeros((3, 3)), "mesh 'leaf': positions: [3, 3] float64; give [n, 3] flo"),
        ("positions", [[0, 0, 0]] * 3, "positions: list; give a numpy array"),
        ("positions", np.zeros((3, 2), np.float32), "positions: [3, 2] float32"),
        ("normals", np.zeros((2, 3), np.float32), "normals: [2, 3] float32; give [3, 3] float32"),
        ("texcoords", np.zeros((3, 2), np.float32), "texcoords: [3, 2] float32"),
        ("colors", np.full((3, 4), np.nan, np.float32), "colors[0]: [nan, nan, nan, nan]"),
        ("triangles", np.array([[0, 1, 3]], np.uint32), "triangles: index 3 out of range"),
        ("triangles", np.array([[0, 1, 2]]), "triangles: [1, 3] int64; give [n, 3] uint32"),
        ("material", -1, "material: -1; give an index from 0"),
    ],
)
def test_a_bad_mesh_names_its_field(field: str, value: object, expected: str) -> None:
    with pytest.raises(SceneError, match="leaf") as caught:
        triangle(**{field: value})
    assert expected in str(caught.value)


@pytest.mark.parametrize(
    ("make", "expected"),
    [
        (lambda: Material("m", base_color=(1, 1, 1, 2)), "material 'm': base_color"),
        (lambda: Material("m", roughness=-0.1), "material 'm': roughness: (-0.1,)"),
        (lambda: Material("m", emissive=(0, np.inf, 0)), "emissive"),
        (lambda: Material("m", alpha_mode="glass"), "alpha_mode: 'glass'"),  # type: ignore[arg-type]
        (lambda: TextureSlot(-1), "image: -1"),
        (lambda: TextureSlot(0, texcoord=2), "texcoord: 2"),
        (lambda: TextureSlot(0, wrap=("clamp", "round")), "wrap"),  # type: ignore[arg-type]
        (lambda: TextureSlot(0, scale=np.nan), "scale: nan"),
        (lambda: TextureSlot(0, uv_transform=np.eye(2)), "uv_transform: [2, 2] float64"),
        (lambda: Image("i", np.zeros((0, 4, 4), np.uint8)), "image 'i': pixels"),
        (lambda: Image("i", np.zeros((4, 4, 3), np.uint8)), "[4, 4, 3] uint8; give [n, n, 4]"),
        (lambda: Instance("n", 0, np.eye(3)), "instance 'n': world_from_local"),
        (lambda: Instance("n", 0, np.full((4, 4), np.nan)), "world_from_local[0]"),
        (lambda: Instance("n", 0, np.ones((4, 4))), "last row [1.0, 1.0, 1.0, 1.0]"),
        (lambda: SceneCamera("c", np.eye(4), 4.0), "camera 'c': yfov_rad: 4.0"),
        (lambda: scene(instances=()), "meshes: 0 triangles"),
        (lambda: scene(materials=()), "mesh 'leaf': material: 0; the scene has 0"),
        (lambda: scene(instances=(Instance("n", 1, np.eye(4)),)), "instance 'n': mesh: 1"),
        (
            lambda: scene(materials=(Material("m", normal_texture=TextureSlot(0)),)),
            "material 'm': normal_texture: image 0; the scene has 0",
        ),
    ],
)
def test_bad_parts_name_their_field(make: Any, expected: str) -> None:
    with pytest.raises(SceneError) as caught:
        make()
    assert expected in str(caught.value)


def test_scenes_cannot_be_written_to() -> None:
    one = scene()
    with pytest.raises(FrozenInstanceError):
        one.name = "two"  # type: ignore[misc]
    with pytest.raises(ValueError, match="read-only"):
        one.meshes[0].positions[0] = 1


def test_the_arrays_of_the_maker_stay_writable() -> None:
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    mesh = triangle(positions=positions)
    assert mesh.positions.base is positions
    positions[0] = 0


def test_counts_and_bounds_are_over_instances() -> None:
    turned = np.array([[0, -2, 0, 5], [2, 0, 0, 0], [0, 0, 2, -1], [0, 0, 0, 1]], np.float64)
    both = scene(instances=(Instance("a", 0, np.eye(4)), Instance("b", 0, turned)))
    assert both.triangle_count == 2
    low, high = both.bounds()
    np.testing.assert_array_equal(low, (0, 0, -1))
    np.testing.assert_array_equal(high, (5, 2, 0))


def test_slots_in_use() -> None:
    slot = TextureSlot(0)
    material = replace(Material("m"), emissive_texture=slot)
    assert material.texture_slots() == {"emissive_texture": slot}

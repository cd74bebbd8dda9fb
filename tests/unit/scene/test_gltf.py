"""glTF reading: layouts, transforms, modes, materials, against hand-built files."""

import math
from typing import Any

import numpy as np
import pytest

from lfd_render.scene import Scene

TRIANGLE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)


def corners(scene: Scene, instance: int = 0) -> np.ndarray:
    """World positions of an instance's triangles, [m, 3, 3]."""
    placed = scene.instances[instance]
    mesh = scene.meshes[placed.mesh]
    p_world = mesh.positions @ placed.world_from_local[:3, :3].T + placed.world_from_local[:3, 3]
    return p_world[mesh.triangles]


def test_a_lone_triangle_gets_a_flat_normal_and_the_default_material(gltf: Any) -> None:
    gltf.triangle()
    scene = Scene.load(gltf.write())
    (mesh,) = scene.meshes
    assert scene.triangle_count == 1
    assert scene.name == "scene"
    np.testing.assert_array_equal(mesh.normals, np.tile([0, 0, 1], (3, 1)))
    np.testing.assert_array_equal(mesh.colors, 1)
    assert (scene.materials[0].metallic, scene.materials[0].roughness) == (1.0, 1.0)


def test_glb_and_gltf_give_the_same(gltf: Any) -> None:
    gltf.triangle()
    from_text = Scene.load(gltf.write())
    from_binary = Scene.load(gltf.write_glb())
    np.testing.assert_array_equal(from_text.meshes[0].positions, from_binary.meshes[0].positions)


def test_buffers_may_be_files_with_escaped_names_in_subfolders(gltf: Any) -> None:
    gltf.triangle()
    (gltf.folder / "da ta").mkdir()
    (gltf.folder / "da ta" / "mesh.bin").write_bytes(gltf.blob)
    gltf.json["buffers"] = [{"byteLength": len(gltf.blob), "uri": "da%20ta/./mesh.bin"}]
    assert Scene.load(gltf.write()).triangle_count == 1


def test_nested_transforms_multiply_from_the_root(gltf: Any) -> None:
    gltf.triangle()
    gltf.json["nodes"][0] |= {"translation": [1, 0, 0]}
    half = math.sqrt(0.5)
    middle = gltf.node(children=[0], rotation=[0, 0, half, half], scale=[2, 2, 2])
    matrix = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 10, 20, 30, 1]
    root = gltf.node(children=[middle], matrix=matrix)
    gltf.json |= {"scene": 0, "scenes": [{"nodes": [root]}]}
    # (1,0,0) + translation = (2,0,0); × 2 = (4,0,0); turned by 90° about z = (0,4,0); moved.
    np.testing.assert_allclose(corners(Scene.load(gltf.write()))[0, 1], (10, 24, 30), atol=1e-12)


def test_a_quaternion_that_is_not_unit_is_normalised(gltf: Any) -> None:
    gltf.triangle()
    gltf.json["nodes"][0]["rotation"] = [0, 0, 3, 3]
    np.testing.assert_allclose(corners(Scene.load(gltf.write()))[0, 1], (0, 1, 0), atol=1e-7)


def test_instances_share_one_mesh(gltf: Any) -> None:
    primitive = gltf.primitive()
    first, second = gltf.mesh(primitive), gltf.mesh(primitive)
    for i, mesh in enumerate((first, first, second)):
        gltf.node(mesh=mesh, translation=[i, 0, 0])
    scene = Scene.load(gltf.write())
    assert len(scene.meshes) == 1
    assert scene.triangle_count == 3
    low, high = scene.bounds()
    np.testing.assert_array_equal((low, high), ((0, 0, 0), (3, 1, 0)))


def test_only_the_default_scene_is_drawn(gltf: Any) -> None:
    gltf.triangle()
    gltf.node(mesh=0, translation=[9, 0, 0])
    gltf.json |= {"scene": 1, "scenes": [{"nodes": [0]}, {"nodes": [1]}]}
    scene = Scene.load(gltf.write())
    assert [i.world_from_local[0, 3] for i in scene.instances] == [9]


def test_a_mirrored_node_keeps_its_matrix(gltf: Any) -> None:
    gltf.triangle()
    gltf.json["nodes"][0]["scale"] = [-1, 1, 1]
    scene = Scene.load(gltf.write())
    assert np.linalg.det(scene.instances[0].world_from_local[:3, :3]) == -1
    np.testing.assert_array_equal(scene.meshes[0].triangles, [[0, 1, 2]])


def test_a_node_scaled_to_nothing_is_left_out(gltf: Any) -> None:
    gltf.triangle()
    gltf.node(mesh=0, scale=[0, 0, 0])
    scene = Scene.load(gltf.write())
    assert len(scene.instances) == 1
    assert any("nodes[1]" in w for w in scene.warnings)


def test_strided_and_offset_accessors(gltf: Any) -> None:
    index = gltf.accessor(TRIANGLE, stride=20)
    gltf.json["accessors"][index] |= {"count": 2, "byteOffset": 20}
    whole = gltf.accessor(TRIANGLE, stride=20)
    gltf.node(mesh=gltf.mesh({"attributes": {"POSITION": whole}}))
    scene = Scene.load(gltf.write())
    np.testing.assert_array_equal(scene.meshes[0].positions, TRIANGLE)


def test_interleaved_attributes_share_a_view(gltf: Any) -> None:
    record = np.zeros(3, [("p", "<f4", 3), ("n", "<f4", 3)])
    record["p"], record["n"] = TRIANGLE, (0, 0, 2)
    view = gltf.view(record.tobytes(), byteStride=24)
    for offset in (0, 12):
        gltf.append(
            "accessors",
            {
                "bufferView": view,
                "byteOffset": offset,
                "componentType": 5126,
                "count": 3,
                "type": "VEC3",
            },
        )
    gltf.node(mesh=gltf.mesh({"attributes": {"POSITION": 0, "NORMAL": 1}}))
    mesh = Scene.load(gltf.write()).meshes[0]
    np.testing.assert_array_equal(mesh.positions, TRIANGLE)
    np.testing.assert_array_equal(mesh.normals, np.tile([0, 0, 1], (3, 1)))


@pytest.mark.parametrize("dtype", ["u1", "u2", "u4"])
def test_indices_of_every_type(gltf: Any, dtype: str) -> None:
    primitive = gltf.primitive()
    primitive["indices"] = gltf.accessor(np.array([2, 0, 1], dtype))
    gltf.node(mesh=gltf.mesh(primitive))
    np.testing.assert_array_equal(corners(Scene.load(gltf.write()))[0], TRIANGLE[[2, 0, 1]])


@pytest.mark.parametrize(
    ("dtype", "stored", "read"),
    [
        ("u1", [0, 51, 255], [0, 0.2, 1]),
        ("u2", [0, 13107, 65535], [0, 0.2, 1]),
        ("i1", [-128, -127, 127], [-1, -1, 1]),
        ("i2", [-32768, -32767, 32767], [-1, -1, 1]),
    ],
)
def test_normalised_integers(gltf: Any, dtype: str, stored: list[int], read: list[float]) -> None:
    values = np.repeat(np.array(stored, dtype)[:, None], 2, axis=1)
    primitive = gltf.primitive()
    primitive["attributes"]["TEXCOORD_0"] = gltf.accessor(values, normalized=True, stride=4)
    gltf.node(mesh=gltf.mesh(primitive))
    texcoords = Scene.load(gltf.write()).meshes[0].texcoords
    np.testing.assert_allclose(texcoords[:, 0, 0], np.array(read, np.float32), rtol=1e-7)


def test_quantised_positions_without_normalisation_are_plain_numbers(gltf: Any) -> None:
    gltf.json["extensionsRequired"] = ["KHR_mesh_quantization"]
    primitive = {"attributes": {"POSITION": gltf.accessor((TRIANGLE * 700).astype("u2"), stride=8)}}
    gltf.node(mesh=gltf.mesh(primitive))
    np.testing.assert_array_equal(Scene.load(gltf.write()).meshes[0].positions, TRIANGLE * 700)


@pytest.mark.parametrize("with_base", [True, False])
def test_sparse_accessors_replace_elements(gltf: Any, with_base: bool) -> None:
    sparse = {
        "count": 2,
        "indices": {
            "bufferView": gltf.view(np.array([1, 2], "u2").tobytes()),
            "componentType": 5123,
        },
        "values": {"bufferView": gltf.view(np.array([[5, 0, 0], [0, 6, 0]], "f4").tobytes())},
    }
    base = gltf.accessor(TRIANGLE + 0, sparse=sparse)
    if not with_base:
        del gltf.json["accessors"][base]["bufferView"]
    gltf.node(mesh=gltf.mesh({"attributes": {"POSITION": base}}))
    positions = Scene.load(gltf.write()).meshes[0].positions
    np.testing.assert_array_equal(positions, [[0, 0, 0], [5, 0, 0], [0, 6, 0]])


def test_strips_and_fans_keep_the_winding(gltf: Any) -> None:
    zigzag = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 2, 0]], np.float32)
    ring = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
    gltf.node(mesh=gltf.mesh({**gltf.primitive(zigzag), "mode": 5}))
    gltf.node(mesh=gltf.mesh({**gltf.primitive(ring), "mode": 6}))
    scene = Scene.load(gltf.write())
    for instance, count in ((0, 3), (1, 2)):
        faces = corners(scene, instance)
        assert len(faces) == count
        normals = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
        assert (normals[:, 2] > 0).all()


def test_a_strip_drops_the_empty_triangles_that_turn_its_corners(gltf: Any) -> None:
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], np.float32)
    primitive = {**gltf.primitive(positions), "mode": 5}
    primitive["indices"] = gltf.accessor(np.array([0, 1, 2, 2, 1, 1, 3], "u1"))
    gltf.node(mesh=gltf.mesh(primitive))
    assert Scene.load(gltf.write()).triangle_count == 1


def test_points_and_lines_are_left_out_with_a_warning(gltf: Any) -> None:
    gltf.node(
        mesh=gltf.mesh(gltf.primitive(), *({**gltf.primitive(), "mode": m} for m in range(4)))
    )
    scene = Scene.load(gltf.write())
    assert scene.triangle_count == 1
    assert len(scene.warnings) == 4
    assert scene.warnings[0] == "meshes[0].primitives[1].mode: points are left out"


def test_vertices_that_nothing_uses_are_dropped(gltf: Any) -> None:
    positions = np.zeros((1000, 3), np.float32)
    positions[[7, 500, 900]] = TRIANGLE
    positions[0] = 1e9
    colors = np.arange(4000, dtype=np.float32).reshape(1000, 4) / 4000
    primitive = gltf.primitive(positions, COLOR_0=colors)
    primitive["indices"] = gltf.accessor(np.array([7, 500, 900], "u2"))
    gltf.node(mesh=gltf.mesh(primitive))
    mesh = Scene.load(gltf.write()).meshes[0]
    np.testing.assert_array_equal(mesh.positions, TRIANGLE)
    np.testing.assert_array_equal(mesh.colors, colors[[7, 500, 900]])


def test_colours_of_three_bytes_get_alpha_one(gltf: Any) -> None:
    primitive = gltf.primitive()
    values = np.array([[255, 0, 51]] * 3, "u1")
    primitive["attributes"]["COLOR_0"] = gltf.accessor(values, stride=4, normalized=True)
    gltf.node(mesh=gltf.mesh(primitive))
    colors = Scene.load(gltf.write()).meshes[0].colors
    np.testing.assert_allclose(colors, np.tile([1, 0, 0.2, 1], (3, 1)), rtol=1e-6)


def test_both_coordinate_sets(gltf: Any) -> None:
    first = np.array([[0, 0], [1, 0], [0, 1]], np.float32)
    gltf.node(mesh=gltf.mesh(gltf.primitive(TEXCOORD_0=first, TEXCOORD_1=first * 4 - 1)))
    texcoords = Scene.load(gltf.write()).meshes[0].texcoords
    np.testing.assert_array_equal(texcoords[:, 0], first)
    np.testing.assert_array_equal(texcoords[:, 1], first * 4 - 1)


def test_normals_without_direction_are_replaced(gltf: Any) -> None:
    normals = np.array([[0, 0, 0], [0, 3, 0], [np.nan, 0, 1]], np.float32)
    gltf.node(mesh=gltf.mesh(gltf.primitive(NORMAL=normals)))
    scene = Scene.load(gltf.write())
    np.testing.assert_array_equal(scene.meshes[0].normals, [[0, 0, 1], [0, 1, 0], [0, 0, 1]])
    assert "2 normals" in scene.warnings[0]


def test_flat_normals_split_shared_vertices(gltf: Any) -> None:
    # Two triangles fold along the shared edge: one faces +z, the other +x.
    positions = np.array([[0, 0, 0], [0, 1, 0], [-1, 0, 0], [0, 0, -1]], np.float32)
    primitive = gltf.primitive(positions)
    primitive["indices"] = gltf.accessor(np.array([0, 1, 2, 0, 3, 1], "u1"))
    gltf.node(mesh=gltf.mesh(primitive))
    mesh = Scene.load(gltf.write()).meshes[0]
    assert len(mesh.positions) == 6
    np.testing.assert_allclose(mesh.normals[:3], np.tile([0, 0, 1], (3, 1)), atol=1e-7)
    np.testing.assert_allclose(mesh.normals[3:], np.tile([1, 0, 0], (3, 1)), atol=1e-7)


@pytest.mark.parametrize("scale", [1e-20, 1e-6, 1e6, 1e15])
def test_flat_normals_of_tiny_and_huge_meshes(gltf: Any, scale: float) -> None:
    gltf.node(mesh=gltf.mesh(gltf.primitive(TRIANGLE * np.float32(scale))))
    normals = Scene.load(gltf.write()).meshes[0].normals
    np.testing.assert_array_equal(normals, np.tile([0, 0, 1], (3, 1)))


def test_morph_targets_stand_at_their_default_weights(gltf: Any) -> None:
    primitive = gltf.primitive()
    deltas = [np.full((3, 3), d, np.float32) for d in (1, 10)]
    primitive["targets"] = [{"POSITION": gltf.accessor(d)} for d in deltas]
    mesh = gltf.mesh(primitive, weights=[0.5, 0.1])
    gltf.node(mesh=mesh)
    gltf.node(mesh=mesh, weights=[0, 1])
    scene = Scene.load(gltf.write())
    assert len(scene.meshes) == 1  # nodes share it
    first, second = (corners(scene.posed(), instance)[0] for instance in (0, 1))
    np.testing.assert_allclose(first, TRIANGLE + 1.5, rtol=1e-6)
    np.testing.assert_allclose(second, TRIANGLE + 10, rtol=1e-6)
    np.testing.assert_allclose(scene.bounds(), [[1.5, 1.5, 1.5], [11, 11, 10]], rtol=1e-6)


def skinned(gltf: Any, normals: np.ndarray | None = None, **joint: Any) -> None:
    """A triangle whose last corner follows a joint that is moved by (5, 0, 0) from its bind."""
    weights = np.array([[1, 0, 0, 0], [1, 0, 0, 0], [0, 2, 0, 0]], np.float32)
    extra = {} if normals is None else {"NORMAL": normals}
    primitive = gltf.primitive(
        JOINTS_0=np.array([[0, 1, 0, 0]] * 3, "u1"), WEIGHTS_0=weights, **extra
    )
    bind = np.eye(4, dtype=np.float32)
    moved = bind.copy()
    moved[:3, 3] = (-1, -2, -3)
    inverse = np.stack([bind.T, moved.T]).reshape(2, 16)  # column after column
    still, other = gltf.node(), gltf.node(**({"translation": [6, 2, 3]} | joint))
    gltf.append("skins", {"joints": [still, other], "inverseBindMatrices": gltf.accessor(inverse)})
    gltf.node(mesh=gltf.mesh(primitive), skin=0, translation=[100, 0, 0])


def test_skins_stand_in_the_pose_of_their_joints(gltf: Any) -> None:
    skinned(gltf)
    # The node's own translation is ignored; weights are scaled to a sum of one.
    expected = TRIANGLE + np.array([[0, 0, 0], [0, 0, 0], [5, 0, 0]])
    scene = Scene.load(gltf.write())
    np.testing.assert_allclose(corners(scene.posed())[0], expected, atol=1e-6)
    np.testing.assert_allclose(scene.bounds()[1], [5, 1, 0], atol=1e-6)


def test_a_mirroring_skin_turns_its_triangles(gltf: Any) -> None:
    skinned(gltf, np.tile(np.array([0, 0, 1], np.float32), (3, 1)))
    gltf.json["nodes"][0] = {"scale": [1, 1, -1]}
    gltf.json["nodes"][1] = {"scale": [1, 1, -1], "translation": [1, 2, -3]}
    scene = Scene.load(gltf.write())
    scene = scene.posed()
    (face,) = corners(scene)
    normal = np.cross(face[1] - face[0], face[2] - face[0])
    mesh = scene.meshes[scene.instances[0].mesh]
    np.testing.assert_allclose(mesh.normals, np.tile([0, 0, -1], (3, 1)), atol=1e-6)
    assert normal[2] < 0


def test_cameras(gltf: Any) -> None:
    gltf.triangle()
    for camera in (
        {"type": "perspective", "name": "front", "perspective": {"yfov": 0.5, "znear": 1}},
        {"type": "orthographic", "orthographic": {}},
    ):
        gltf.node(camera=gltf.append("cameras", camera), translation=[0, 0, 7])
    scene = Scene.load(gltf.write())
    (camera,) = scene.cameras
    assert (camera.name, camera.yfov_rad, camera.world_from_camera[2, 3]) == ("front", 0.5, 7)
    assert any("orthographic" in w for w in scene.warnings)


def test_unknown_optional_extensions_give_one_warning(gltf: Any) -> None:
    gltf.triangle()
    gltf.json["extensionsUsed"] = ["X_b", "KHR_materials_unlit", "X_a"]
    assert Scene.load(gltf.write()).warnings == ("extensionsUsed: ignored X_a, X_b",)


def test_very_deep_node_chains(gltf: Any) -> None:
    gltf.triangle()
    for _ in range(5000):
        gltf.node(children=[len(gltf.json["nodes"]) - 1], translation=[1, 0, 0])
    assert Scene.load(gltf.write()).bounds()[0][0] == 5000

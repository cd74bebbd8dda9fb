"""Nodes, skins and morphs in poses: analytic answers, a slow twin, and what is refused."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lfd_render.errors import ResourceError, SceneError
from lfd_render.scene import (
    NO_PARENT,
    Influences,
    Instance,
    Light,
    LoadLimits,
    Material,
    Mesh,
    Morph,
    Nodes,
    Pose,
    Poser,
    Scene,
    SceneCamera,
    Skin,
    node_transform,
)
from lfd_render.scene.deform import MOST_TARGETS

from .conftest import TRIANGLE, GltfBuilder

QUARTER = (0.0, 0.0, 0.5**0.5, 0.5**0.5)  # about +z, counter-clockwise


def leaf(**more: Any) -> Mesh:
    """One triangle, which faces +z."""
    normals = np.tile(np.array([0, 0, 1], np.float32), (3, 1))
    texcoords, colors = np.zeros((3, 2, 2), np.float32), np.ones((3, 4), np.float32)
    return Mesh("leaf", TRIANGLE, normals, texcoords, colors, np.uint32([[0, 1, 2]]), 0, **more)


def arm() -> Scene:
    """A leaf on a hand on an arm, with a light and a camera on the hand."""
    nodes = Nodes(
        ("arm", "hand"),
        np.array([NO_PARENT, 0]),
        np.stack([node_transform((1, 0, 0)), node_transform((0, 2, 0))]),
    )
    hand = nodes.world()[1]
    return Scene(
        "arm",
        (leaf(),),
        (Instance("leaf", 0, hand, 1), Instance("still", 0, np.eye(4))),
        (Material("plain"),),
        cameras=(SceneCamera("eye", hand, 1.0, 1),),
        lights=(Light("lamp", "point", hand, node=1),),
        nodes=nodes,
    )


def deforming(influences: Influences | None = None, **more: Any) -> Scene:
    """A leaf with two morph targets, on a skin of two joints if it is given influences."""
    shift = np.zeros((2, 3, 3), np.float32)
    shift[0, :, 0], shift[1, 2, 2] = 1.0, 4.0
    turn = np.zeros((2, 3, 3), np.float32)
    turn[1, :, 1] = 1.0
    mesh = leaf(morph=Morph(shift, turn), influences=influences, **more)
    nodes = Nodes(("a", "b"), np.array([NO_PARENT, NO_PARENT]), np.tile(np.eye(4), (2, 1, 1)))
    skin = Skin("skin", np.array([0, 1]), np.tile(np.eye(4), (2, 1, 1)))
    instance = Instance("leaf", 0, np.eye(4), 0, 0 if influences else None, (0.0, 0.0))
    return Scene(
        "deforming", (mesh,), (instance,), (Material("plain"),), nodes=nodes,
        skins=(skin,) if influences else (),
    )  # fmt: skip


def posed_mesh(scene: Scene, pose: Pose | None = None) -> Mesh:
    still = scene.posed(pose)
    return still.meshes[still.instances[0].mesh]


def test_an_instance_stands_where_its_node_does() -> None:
    """What would be lost as soon as the scene is posed is refused."""
    scene = arm()
    moved = replace(scene.instances[0], world_from_local=node_transform((5, 0, 0)))
    with pytest.raises(SceneError, match="world_from_local: differs from where its node 1 is"):
        replace(scene, instances=(moved, scene.instances[1]))
    loose = replace(scene, instances=(replace(moved, node=None), scene.instances[1]))
    np.testing.assert_array_equal(loose.posed().instances[0].world_from_local[:3, 3], [5, 0, 0])


def test_what_hangs_on_a_node_moves_with_it_and_its_parents() -> None:
    scene = arm()
    pose = Pose({"arm": node_transform((1, 0, 0), QUARTER), 1: node_transform((0, 3, 0))})
    still = scene.posed(pose)
    expected = np.array([[0, -1, 0, -2], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    for matrix in (
        still.instances[0].world_from_local,
        still.lights[0].world_from_light,
        still.cameras[0].world_from_camera,
    ):
        np.testing.assert_allclose(matrix, expected, atol=1e-15)
    np.testing.assert_array_equal(still.instances[1].world_from_local, np.eye(4))
    assert len(still.nodes) == 0
    np.testing.assert_allclose(still.bounds()[0], [-3, 0, 0], atol=1e-7)
    np.testing.assert_allclose(scene.bounds()[1], [2, 3, 0])  # at rest still


def test_rest_is_the_pose_of_nothing() -> None:
    scene = arm()
    for pose in (None, Pose()):
        for rest, posed in zip(scene.instances, scene.posed(pose).instances, strict=True):
            np.testing.assert_array_equal(rest.world_from_local, posed.world_from_local)


def test_morphs_add_up() -> None:
    found = posed_mesh(deforming(), Pose(weights={"a": (2.0, 0.5)}))
    np.testing.assert_array_equal(found.positions, TRIANGLE + np.float32([[2, 0, 0]] * 3)
                                  + np.float32([[0, 0, 0], [0, 0, 0], [0, 0, 2]]))  # fmt: skip
    np.testing.assert_allclose(found.normals, [np.array([0, 0.5, 1]) / 1.25**0.5] * 3, rtol=1e-6)


def test_flat_normals_follow_the_triangle() -> None:
    found = posed_mesh(deforming(flat=True), Pose(weights={0: (0.0, 0.25)}))
    np.testing.assert_allclose(found.normals, [np.array([0, -1, 1]) / 2**0.5] * 3, rtol=1e-6)


def test_a_skin_mirrors_where_most_of_it_does() -> None:
    """Its triangles turn round, and flat normals with them."""
    most = Influences.scaled(np.array([[0, 1, 0, 0]] * 3), np.array([[1, 3, 0, 0]] * 3))
    for flat in (False, True):
        scene = deforming(most, flat=flat)
        mirror = node_transform(scale=(-1.0, 1.0, 1.0))
        for node, mirrored in ((0, False), (1, True)):
            found = posed_mesh(scene, Pose({node: mirror}))
            corners = found.positions[found.triangles[0]].astype(np.float64)
            facing = np.cross(corners[1] - corners[0], corners[2] - corners[0])[2]
            assert list(found.triangles[0]) == ([2, 1, 0] if mirrored else [0, 1, 2])
            assert (facing > 0) == (found.normals[0, 2] > 0)
            assert (Poser(scene)(Pose({node: mirror})).mirrored == [mirrored]).all()


@given(seed=st.integers(0, 2**32 - 1))
def test_skinning_has_a_slow_twin(seed: int) -> None:
    """The formula of glTF 2.0, section 3.7.3.3, vertex by vertex and joint by joint."""
    rng = np.random.default_rng(seed)
    matrices = np.tile(np.eye(4), (4, 1, 1))
    matrices[:, :3] += rng.uniform(-0.3, 0.3, (4, 3, 4))
    influences = Influences.scaled(rng.integers(0, 2, (3, 8)), rng.uniform(0, 1, (3, 8)))
    scene = deforming(influences)
    scene = replace(scene, skins=(Skin("skin", np.array([0, 1]), matrices[2:]),))
    weights = rng.uniform(-1, 1, 2)
    found = posed_mesh(scene, Pose({0: matrices[0], 1: matrices[1]}, {0: weights}))
    morph = scene.meshes[0].morph
    assert morph is not None
    for vertex in range(3):
        p, n = TRIANGLE[vertex].astype(np.float64), np.array([0.0, 0.0, 1.0])
        for weight, shift, turn in zip(weights, morph.positions, morph.normals, strict=True):
            p, n = p + weight * shift[vertex], n + weight * turn[vertex]
        blend = np.zeros((4, 4))
        for joint, weight in zip(
            influences.joints[vertex], influences.weights[vertex], strict=True
        ):
            blend += float(weight) * (matrices[joint] @ matrices[2 + joint])
        n = np.linalg.inv(blend[:3, :3]).T @ n
        np.testing.assert_allclose(
            found.positions[vertex],
            (blend @ [*p, 1.0])[:3],
            atol=1e-6,  # float32
        )
        np.testing.assert_allclose(found.normals[vertex], n / np.linalg.norm(n), atol=1e-6)


def test_weights_are_scaled_to_a_sum_of_one() -> None:
    found = Influences.scaled(np.array([[5, 2, 1, 0]] * 2), np.array([[2, 6, 0, 0], [0, 0, 0, 0]]))
    np.testing.assert_array_equal(found.weights, [[0.25, 0.75, 0, 0], [1, 0, 0, 0]])
    np.testing.assert_allclose(found.joint_shares, [0, 0, 0.75, 0, 0, 1.25])


# ---- refused ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("pose", "message"),
    [
        (lambda: Pose({"x": np.eye(4)}), "pose: node 'x': no node has this name; give the index"),
        (lambda: Pose({2: np.eye(4)}), "pose: node 2: give 0 to 1"),
        (lambda: Pose({-1: np.eye(4)}), "pose: node -1: give 0 to 1"),
        (lambda: Pose({0.5: np.eye(4)}), "pose: transforms: node 0.5; give an index or a name"),
        (lambda: Pose({True: np.eye(4)}), "pose: transforms: node True; give an index or a name"),
        (lambda: Pose({0: np.eye(3)}), "pose: transform of node 0: [[1.0, 0.0, 0.0], [0.0, 1.0"),
        (lambda: Pose({0: np.ones((4, 4))}), "whose last row is 0 0 0 1"),
        (lambda: Pose({0: np.full((4, 4), np.nan)}), "give finite numbers"),
        (lambda: Pose({0: "turn"}), "pose: transform of node 0: 'turn'; give finite numbers"),
        (lambda: Pose({"a": np.eye(4), 0: np.eye(4)}), "node 0: given as node 'a' too; give it o"),
        (lambda: Pose([np.eye(4)]), "pose: transforms: list; give a dict by node"),
        (lambda: Pose(weights={0: 3.0}), "pose: weights of node 0: 3.0; give one number a target"),
        (lambda: Pose(weights={0: (1.0,)}), "pose: weights of node 0: 1 of them; its mesh has 2"),
        (lambda: Pose(weights={"b": (1.0, 2.0)}), "node 'b': it draws no mesh with morph targets"),
    ],
)  # fmt: skip
def test_a_bad_pose_names_its_node(pose: Any, message: str) -> None:
    with pytest.raises(SceneError, match=re.escape(message)):
        deforming().posed(pose())


def test_a_pose_that_overflows() -> None:
    huge = node_transform((1e308, 0, 0), scale=(1e308, 1, 1))
    with pytest.raises(SceneError, match="pose: node 1 'hand': its world transform overflows"):
        arm().posed(Pose({0: huge, 1: huge}))


def test_joints_that_overflow() -> None:
    """The planted node is finite, and so is the inverse bind matrix."""
    scene = deforming(Influences.scaled(np.array([[0, 1, 0, 0]] * 3), np.ones((3, 4))))
    bind = np.stack([np.eye(4), node_transform(scale=(1e200, 1, 1))])
    scene = replace(scene, skins=(Skin("skin", np.array([0, 1]), bind),))
    with pytest.raises(SceneError, match="pose: node 1 'b': what it moves as a joint overflows"):
        scene.posed(Pose({"b": node_transform(scale=(1e200, 1, 1))}))


@pytest.mark.parametrize("scale", [1e-160, 1e-6, 1.0, 1e6, 1e160])
def test_tiny_and_huge_skins_are_bounded_and_mirrored(scale: float) -> None:
    scene = deforming(Influences.scaled(np.array([[0, 1, 0, 0]] * 3), np.ones((3, 4))))
    for sign in (1.0, -1.0):
        local = np.tile(node_transform(scale=(sign * scale, scale, scale)), (2, 1, 1))
        nodes = replace(scene.nodes, parent_from_node=local)
        placed = replace(scene, nodes=nodes)
        low, high = placed.bounds()
        np.testing.assert_allclose(np.abs(high - low) / scale, [1, 1, 0], rtol=1e-6)
        assert list(Poser(placed)().mirrored) == [sign < 0.0]


def test_a_name_of_two_nodes_is_no_name() -> None:
    scene = arm()
    twins = replace(scene, nodes=replace(scene.nodes, names=("a", "a")))
    with pytest.raises(
        SceneError, match=r"node 'a': nodes \[0, 1\] have this name; give the index"
    ):
        twins.posed(Pose({"a": np.eye(4)}))


def test_a_pose_keeps_copies() -> None:
    matrix = np.eye(4)
    pose = Pose({0: matrix})
    matrix[0, 3] = 5.0
    assert pose.transforms[0][0, 3] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        pose.transforms[0][0, 3] = 1.0
    with pytest.raises(TypeError):
        pose.transforms[1] = matrix  # type: ignore[index]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Nodes(("a",), np.array([0]), np.eye(4)[None]), "parents[0]: the node is its own"),
        (lambda: Nodes(("a",), np.array([1]), np.eye(4)[None]), "parents[0]: 1; give a node from"),
        (lambda: Nodes(("a",), np.array([-1]), np.ones((1, 4, 4))), "parent_from_node[0]: last"),
        (lambda: Nodes(("a", "b"), np.array([-1]), np.eye(4)[None]), "parents: [1] int64; give"),
        (lambda: Skin("s", np.zeros(0, int), np.zeros((0, 4, 4))), "skin 's': joints: none"),
        (lambda: Influences(np.zeros((3, 3), np.uint16), np.zeros((3, 3), np.float32)), "3 a ver"),
        (lambda: Influences(np.zeros((1, 4), np.uint16), np.zeros((1, 4), np.float32)), "sum 1"),
        (lambda: Morph(*np.zeros((2, 0, 3, 3), np.float32)), f"give 1 to {MOST_TARGETS}"),
        (lambda: leaf(morph=Morph(*np.zeros((2, 1, 4, 3), np.float32))), "4 displacements a"),
        (lambda: leaf(influences=Influences.scaled(*np.ones((2, 4, 4), int))), "of 4 vertices"),
        (lambda: replace(leaf(flat=True), triangles=np.uint32([[0, 2, 1]])), "triangles share"),
        (lambda: node_transform(rotation=(0, 0, 0, 0)), "rotation: [0, 0, 0, 0]; give a unit"),
        (lambda: replace(arm(), nodes=Nodes()), "instance 'leaf': node: 1; the scene has 0"),
        (lambda: replace(arm(), skins=(Skin("s", np.array([2]), np.eye(4)[None]),)), "skin 's'"),
        (lambda: Instance("i", 0, np.eye(4), weights=(np.nan,)), "instance 'i': weights"),
        (lambda: replace(deforming(), instances=(Instance("i", 0, np.eye(4)),)), "weights: 0"),
        (lambda: replace(arm(), instances=(Instance("i", 0, np.eye(4), 0, 0),)), "skin: 0; the"),
    ],
)  # fmt: skip
def test_bad_parts_are_named(make: Any, message: str) -> None:
    with pytest.raises(SceneError, match=re.escape(message)):
        make()


# ---- glTF -------------------------------------------------------------------------------------


def skinned(gltf: GltfBuilder, sets: int, joints: int = 2, **target: Any) -> dict[str, Any]:
    """A primitive whose vertices follow the last joint of the last set."""
    attributes: dict[str, Any] = {}
    for number in range(sets):
        last = number == sets - 1
        attributes[f"JOINTS_{number}"] = np.full((3, 4), joints - 1 if last else 0, "u1")
        attributes[f"WEIGHTS_{number}"] = np.tile(np.float32([last, 0, 0, 0]), (3, 1))
    return gltf.primitive(**attributes)


@pytest.mark.parametrize("sets", [1, 2, 3])
def test_all_sets_of_influences_count(gltf: GltfBuilder, sets: int) -> None:
    mesh = gltf.mesh(skinned(gltf, sets))
    gltf.node(name="first")
    gltf.node(name="second", translation=[0, 0, 1])
    gltf.append("skins", {"joints": [0, 1]})
    gltf.node(mesh=mesh, skin=0)
    scene = Scene.load(gltf.write())
    influences = scene.meshes[0].influences
    assert influences is not None
    assert influences.joints.shape == (3, 4 * sets)
    np.testing.assert_array_equal(posed_mesh(scene).positions[:, 2], 1.0)
    moved = posed_mesh(scene, Pose({"second": node_transform((0, 0, 7))}))
    np.testing.assert_array_equal(moved.positions[:, 2], 7.0)
    assert moved.name == scene.meshes[0].name


def test_nodes_share_a_mesh_whatever_moves_it(gltf: GltfBuilder) -> None:
    """Two skins of as many joints and other weights need no mesh of their own."""
    primitive = skinned(gltf, 1)
    primitive["targets"] = [{"POSITION": gltf.accessor(TRIANGLE)}]
    mesh = gltf.mesh(primitive)
    joints = [gltf.node(translation=[0, 0, z]) for z in range(4)]
    for number in (0, 1):
        gltf.append("skins", {"joints": joints[2 * number : 2 * number + 2]})
        gltf.node(mesh=mesh, skin=number, weights=[number])
    scene = Scene.load(gltf.write())
    assert len(scene.meshes) == 1
    still = scene.posed()
    for instance, offset, scale in zip(still.instances, (1, 3), (1, 2), strict=True):
        found = still.meshes[instance.mesh].positions
        np.testing.assert_array_equal(found, scale * TRIANGLE + np.float32([0, 0, offset]))


def test_morph_targets_keep_normals_and_unshared_vertices(gltf: GltfBuilder) -> None:
    """A mesh without normals is flat: its displacements are taken apart with its vertices."""
    square = np.float32([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    rise = np.float32([[0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 1]])
    indices = gltf.accessor(np.array([0, 1, 2, 0, 2, 3], "u1"))
    for extra in ({}, {"NORMAL": np.tile(np.float32([0, 0, 1]), (4, 1))}):
        primitive = {**gltf.primitive(square, **extra), "indices": indices}
        target = {"POSITION": gltf.accessor(rise)}
        if extra:
            target["NORMAL"] = gltf.accessor(rise * 3)
        gltf.node(mesh=gltf.mesh({**primitive, "targets": [target]}))
    flat, smooth = Scene.load(gltf.write()).meshes
    assert flat.morph is not None
    assert smooth.morph is not None
    assert (flat.flat, smooth.flat) == (True, False)
    np.testing.assert_array_equal(flat.morph.positions[0, :, 2], [0, 0, 0, 0, 0, 1])
    np.testing.assert_array_equal(smooth.morph.normals[0, :, 2], [0, 0, 0, 3])


def test_what_is_flat_at_rest_may_grow_in_an_animated_file(gltf: GltfBuilder) -> None:
    gltf.triangle()
    hidden = gltf.triangle()
    gltf.json["nodes"][hidden] |= {"scale": [0, 0, 0], "translation": [100, 0, 0]}
    assert len(Scene.load(gltf.write()).instances) == 1
    gltf.json["animations"] = [{"channels": [], "samplers": []}]
    scene = Scene.load(gltf.write())
    assert len(scene.instances) == 2
    np.testing.assert_array_equal(scene.bounds()[1], [1, 1, 0])
    shown = scene.posed(Pose({hidden: np.eye(4)}))
    np.testing.assert_array_equal(shown.instances[1].world_from_local, np.eye(4))


def test_displacements_count_as_bytes_of_meshes(gltf: GltfBuilder) -> None:
    primitive = gltf.primitive()
    primitive["targets"] = [{"POSITION": gltf.accessor(TRIANGLE)}] * 100
    gltf.node(mesh=gltf.mesh(primitive))
    path = gltf.write()
    Scene.load(path, LoadLimits(mesh_bytes=7500))
    with pytest.raises(ResourceError, match="mesh_bytes"):
        Scene.load(path, LoadLimits(mesh_bytes=7000))

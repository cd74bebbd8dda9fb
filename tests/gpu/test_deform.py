"""Morphs, skins and moved nodes on the device, against the reference and against still scenes."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from lfd_render.display import DisplayProfile, ViewGrid
from lfd_render.errors import SceneError
from lfd_render.gpu import scene_buffers
from lfd_render.gpu.device import Device
from lfd_render.gpu.scene_buffers import SceneBuffers
from lfd_render.reference import placed
from lfd_render.reference.transform import ordered_instances
from lfd_render.renderer import Renderer, camera_for
from lfd_render.scene import (
    Influences,
    Instance,
    Material,
    Morph,
    Nodes,
    Pose,
    Poser,
    Scene,
    Skin,
)  # fmt: skip

from .helpers import PAPER, exact_views, examples, passes, random_camera
from .moving import SMALL, mesh, random_moving, reed, reed_camera, reed_pose, turn
from .test_transform import EPSILON, OCTAHEDRAL_RAD, placed_by_device

pytestmark = pytest.mark.needs("gl")

seeds = st.integers(0, 2**32 - 1)


@dataclasses.dataclass(frozen=True, eq=False)
class Bounds:
    """How far the device may be off the reference, by triangle and corner: positions_mm
    [triangle, corner, xyz], normals_rad [triangle, corner]."""

    positions_mm: NDArray[np.float64]
    normals_rad: NDArray[np.float64]


def bounds(scene: Scene, pose: Pose | None, display_from_world: NDArray[np.float64]) -> Bounds:
    """Positions: each rounding is off by ε of the sum of the sizes of what is added. A morph of T
    targets rounds weights, products and sums (T + 2), a blend of k matrices their entries, products
    and sums (k + 2), their product with a point four products and three sums (4).

    Normals: rounded to 16 bits before and after, stretched between by the blended matrix, and
    lengthened by what the morph took off them. Rounding of the cofactors, of the square of the
    stretch, comes to 40 ε; flat ones go by edges whose ends are off as positions are.
    """
    poser = Poser(scene)
    posed = poser(pose)
    positions, normals = [], []
    for index, instance, shape in ordered_instances(scene):
        size = np.abs(shape.positions).astype(np.float64)
        local = shape.normals.astype(np.float64)
        rounds = 6
        first = poser.first_weight[index]
        for target in range(shape.target_count):
            weight = posed.weights[first + target]
            assert shape.morph is not None
            size += abs(weight) * np.abs(shape.morph.positions[target])
            local += weight * shape.morph.normals[target]
        rounds += shape.target_count + 2
        world = np.broadcast_to(posed.world_from_instance[index], (len(size), 4, 4))
        matrices = display_from_world @ world
        sizes = np.abs(matrices)
        if instance.skin is not None:
            assert shape.influences is not None
            rounds += shape.influences.joints.shape[1] + 2
            joints = display_from_world @ posed.world_from_bind[poser.first_joint[index] :]
            picked = joints[shape.influences.joints]  # [vertex, joint, 4, 4]
            share = shape.influences.weights[..., None, None].astype(np.float64)
            matrices, sizes = (share * picked).sum(axis=1), (share * np.abs(picked)).sum(axis=1)
        off = np.einsum("nij,nj->ni", sizes[:, :3, :3], size) + sizes[:, :3, 3]
        off *= rounds * EPSILON
        positions.append(off[shape.triangles])
        stretch = np.linalg.cond(matrices[:, :3, :3])
        short = np.maximum(np.linalg.norm(local, axis=1), 1e-6)
        angle = OCTAHEDRAL_RAD * (1.0 + stretch / short) + 40.0 * EPSILON * stretch**2 / short
        if shape.flat and scene.deforms(instance):
            angle = np.zeros(len(size))
        normals.append(angle[shape.triangles])
    return Bounds(np.concatenate(positions), np.concatenate(normals))


def flat_bounds(
    p_display: NDArray[np.float64], off: NDArray[np.float64], stretch: float
) -> NDArray[np.float64]:
    """How far a triangle's own normal may turn, [triangle] rad: by what its corners are off over
    its least height, turned to the world by a matrix of that stretch, and rounded."""
    u, v = p_display[:, 1] - p_display[:, 0], p_display[:, 2] - p_display[:, 0]
    area_2 = np.linalg.norm(np.cross(u, v), axis=1)
    longest = np.sqrt(np.max([(u**2).sum(1), (v**2).sum(1), ((u - v) ** 2).sum(1)], axis=0))
    turned = 2.0 * np.linalg.norm(off, axis=2).max(axis=1) * longest / np.maximum(area_2, 1e-9)
    rounded = 16.0 * EPSILON * longest**2 / np.maximum(area_2, 1e-9)
    return stretch * (turned + rounded) + OCTAHEDRAL_RAD


@examples(12)
@given(seed=seeds)
def test_vertices_go_where_pose_skins_and_morphs_say(device: Device, seed: int) -> None:
    rng = np.random.default_rng(seed)
    profile = DisplayProfile.load(PAPER)
    scene, pose = random_moving(rng)
    display_from_world = random_camera(rng, profile.size_mm)
    grid = ViewGrid.upright(profile, 4, 3)
    expected = placed(scene, display_from_world, pose)
    limit = bounds(scene, pose, display_from_world)
    with passes(device, scene, profile.rig(1), grid, display_from_world, pose=pose) as opened:
        p_display, normals = placed_by_device(opened)
        runs = [run for batch in opened.buffers.batches for run in opened.buffers.runs(batch)]
    off = np.abs(p_display - expected.p_display)
    assert np.all(off <= limit.positions_mm)

    cosine = np.sum(normals * expected.normals_world, axis=-1)
    crossed = np.linalg.norm(np.cross(normals, expected.normals_world), axis=-1)
    angle = np.arctan2(crossed, cosine)
    stretch = np.linalg.cond(display_from_world[:3, :3])
    flat = flat_bounds(expected.p_display, limit.positions_mm, stretch)[:, None]
    allowed = np.where(limit.normals_rad > 0.0, limit.normals_rad, flat)
    areas = flat[:, 0] < 0.1  # a triangle seen nearly edge-on by rounding has any normal
    assert np.all(angle[areas] <= allowed[areas] + 1e-7)
    assert areas.mean() > 0.8

    mirrored = np.repeat([run.mirrored for run in runs], [run.count for run in runs])
    np.testing.assert_array_equal(mirrored, expected.mirrored)

    # Planted fault: the scene at rest.
    rest = placed(scene, display_from_world)
    assert np.any(np.abs(p_display - rest.p_display) > limit.positions_mm + 0.1)


def test_what_does_not_move_goes_the_way_it_went(device: Device) -> None:
    """Rigid vertices go through the kernel of scenes without any that deform, to the bit."""
    profile = DisplayProfile.load(PAPER)
    scene = reed()
    still = scene.posed(reed_pose(1.0))
    grid = ViewGrid.upright(profile, 4, 3)
    matrix = reed_camera(profile).display_from_world(profile.size_mm)
    corners = len(scene.meshes[0].triangles)
    found = []
    for which, pose in ((scene, reed_pose(1.0)), (still, None)):
        with passes(device, which, profile.rig(1), grid, matrix, pose=pose) as opened:
            batch = opened.buffers.batches[0]
            assert (batch.deform is None) == (which is still)
            assert batch.rigid_vertices == (4 if which is scene else batch.vertices)
            found.append(placed_by_device(opened)[0])
    np.testing.assert_array_equal(found[0][corners:], found[1][corners:])
    assert np.abs(found[0][:corners] - found[1][:corners]).max() < 1e-4  # mm, of 300


# ---- pictures ---------------------------------------------------------------------------------


def exact_scene() -> tuple[Scene, Pose]:
    """Cards whose every number is a power of two or a sum of few: a skin of two joints that are
    turned by quarters and moved, a morph, flat normals, on three materials."""
    corners = np.array([[-24, -16, 0], [24, -16, 0], [24, 16, 0], [-24, 16, 0]], np.float64)
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    loose = corners[triangles.ravel()]
    half = Influences.scaled(
        np.array([[0, 1, 0, 0]] * 4),
        np.array([[4, 0, 0, 0], [2, 2, 0, 0], [1, 3, 0, 0], [3, 1, 0, 0]]),
    )
    one = Influences.scaled(np.array([[1, 0, 0, 0]] * 6), np.array([[1, 0, 0, 0]] * 6))
    deltas = np.array([[[8, 0, 16], [0, 8, 0], [0, 0, 0], [0, 0, -8]]], np.float32)
    meshes = (
        mesh(corners, triangles, 0, influences=half),
        mesh(loose, np.arange(6).reshape(2, 3), 1, influences=one, flat=True),
        mesh(corners, triangles, 2, morph=Morph(deltas, np.zeros((1, 4, 3), np.float32))),
        mesh(corners, triangles, 0),
    )
    names = ("still", "joint", "morphed", "carried")
    local = np.tile(np.eye(4), (4, 1, 1))
    local[2, :3, 3], local[3, :3, 3] = (48, 8, 32), (-64, 0, -16)
    nodes = Nodes(names, np.array([-1, 0, -1, -1]), local)
    instances = (
        Instance("skinned", 0, np.eye(4), 0, 0),
        Instance("flat", 1, np.eye(4), 0, 0),
        Instance("morphed", 2, nodes.world()[2], 2, None, (0.0,)),
        Instance("carried", 3, nodes.world()[3], 3),
    )
    materials = (
        Material("solid", (0.9, 0.3, 0.2, 1.0), 0.0, 0.5),
        Material("both", (0.2, 0.6, 0.9, 1.0), 0.5, 0.3, double_sided=True),
        Material("glass", (0.3, 0.9, 0.3, 0.5), 0.0, 0.6, alpha_mode="blend"),
    )
    skin = Skin("skin", np.array([0, 1]), np.tile(np.eye(4), (2, 1, 1)))
    scene = Scene("exact", meshes, instances, materials, nodes=nodes, skins=(skin,))
    quarter = np.array([[0, 0, 1, 32], [0, 1, 0, -8], [-1, 0, 0, 64], [0, 0, 0, 1]], np.float64)
    carried = np.array([[0, -1, 0, -48], [1, 0, 0, 8], [0, 0, 1, 24], [0, 0, 0, 1]], np.float64)
    moved = np.eye(4)
    moved[:3, 3] = 8, -16, 48
    return scene, Pose({"joint": quarter, "carried": carried, "still": moved}, {2: (1.5,)})


@pytest.mark.parametrize("winners", ["owned", "two-pass"])
def test_exact_numbers_give_the_bits_of_a_still_scene(device: Device, winners: str) -> None:
    scene, pose = exact_scene()
    still = scene.posed(pose)
    rig, grid = exact_views()

    def picture(which: Scene, pose: Pose | None = None) -> NDArray[np.float64]:
        with passes(device, which, rig, grid, pose=pose, winners=winners) as opened:
            return opened.images()

    found = picture(scene, pose)
    assert len(np.unique(found.reshape(-1, 3), axis=0)) > 20
    np.testing.assert_array_equal(found, picture(still))
    assert np.mean(found != picture(scene)) > 0.05  # the planted fault: nothing moved


def moved_views(device: Device, scene: Scene, pose: Pose) -> tuple[NDArray, NDArray, NDArray]:
    """Views of a scene in a pose, of the still scene that the pose makes, and at rest."""
    display = DisplayProfile.load(PAPER)
    camera = camera_for(scene, display).turned(0.6)
    with Renderer(device) as renderer:
        found = renderer.views(scene, display, camera, pose=pose, **SMALL)
        rest = renderer.views(scene, display, camera, **SMALL)
        still = renderer.views(scene.posed(pose), display, camera, **SMALL)
    return found.astype(int), still.astype(int), rest.astype(int)


def alike(found: NDArray, still: NDArray, rest: NDArray) -> tuple[float, float]:
    """Shares of pixels more than 3 levels from the still scene, and from the scene at rest."""
    return tuple(  # type: ignore[return-value]
        float((np.abs(found - other).max(axis=-1) > 3).mean()) for other in (still, rest)
    )


# A still scene has its vertices rounded to single precision in the world, a posed one in display
# space: edges a rounding apart take another pixel here and there. None of these scenes has more.
MOST_OFF = 1e-3


def test_a_moved_node_is_a_moved_instance_to_the_bit(device: Device) -> None:
    scene = reed()
    pose = Pose({"leaf": turn(1, 0.7, translation=(1.7, 0.2, 0.3))})
    moved = dataclasses.replace(
        scene.instances[1], world_from_local=pose.transforms["leaf"], node=None
    )
    rebuilt = dataclasses.replace(scene, instances=(scene.instances[0], moved))
    display = DisplayProfile.load(PAPER)
    camera = reed_camera(display)
    with Renderer(device) as renderer:
        found = renderer.views(scene, display, camera, pose=pose, **SMALL)
        expected = renderer.views(rebuilt, display, camera, **SMALL)
        rest = renderer.views(scene, display, camera, **SMALL)
        empty = renderer.views(scene, display, camera, pose=Pose(), **SMALL)
    np.testing.assert_array_equal(found, expected)
    np.testing.assert_array_equal(rest, empty)
    assert np.any(found != rest)


def test_a_bent_and_morphed_reed(device: Device) -> None:
    """Its light hangs on its tip and moves with it."""
    off, moved = alike(*moved_views(device, reed(), reed_pose(1.0)))
    assert off <= MOST_OFF
    assert moved > 0.02
    scene = reed()
    unlit = dataclasses.replace(scene, lights=scene.lights[:1])
    lit = [moved_views(device, which, reed_pose(1.0))[0] for which in (scene, unlit)]
    assert np.abs(lit[0] - lit[1]).max() > 20


def bent(scene: Scene, *names: str) -> Pose:
    """Joints turned by half a radian about their own x."""
    places = [scene.nodes.places[name][0] for name in names]
    return Pose({i: scene.nodes.parent_from_node[i] @ turn(0, 0.5) for i in places})


def test_real_files_move(device: Device, assets: Path) -> None:
    poses = {
        "Fox.glb": lambda scene: bent(scene, "b_Neck_04", "b_Tail01_012", "b_LeftLeg01_015"),
        "SimpleSkin.gltf": lambda scene: Pose({2: turn(2, 0.6)}),
        "MorphStressTest.gltf": lambda scene: Pose(
            weights={"Main": [1, 0, 0.5, 0, 0, 0.7, 0, 0.2]}
        ),
    }
    for name, pose in poses.items():
        scene = Scene.load(assets / "animated" / name)
        off, moved = alike(*moved_views(device, scene, pose(scene)))
        assert off <= MOST_OFF, name
        assert moved > 0.02, name


# ---- memory and errors ------------------------------------------------------------------------


def test_displacements_beyond_a_buffer_go_into_more_batches(
    device: Device, rng: np.random.Generator
) -> None:
    """Draws of one mesh share them; a mesh of too many is cut."""
    profile = DisplayProfile.load(PAPER)
    scene, pose = random_moving(rng, 30)
    expected = placed(scene, np.eye(4), pose)
    grid = ViewGrid.upright(profile, 4, 3)
    with passes(device, scene, profile.rig(1), grid, pose=pose) as opened:
        whole = placed_by_device(opened)
        few = len(opened.batches)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(scene_buffers, "BATCH_DELTAS", 50)
        with passes(device, scene, profile.rig(1), grid, pose=pose) as opened:
            cut = placed_by_device(opened)
            assert len(opened.batches) > few + 3
            for batch, _ in opened.batches:
                if batch.deform:
                    assert batch.deform.buffers()["MorphDeltas"].size <= 50 * 28
    assert len(expected) == len(cut[0])
    for found, same in zip(cut, whole, strict=True):
        np.testing.assert_array_equal(found, same)


def test_draws_of_a_mesh_share_what_deforms_it(device: Device) -> None:
    one = reed()
    crowd = dataclasses.replace(one, instances=(one.instances[0],) * 20)
    sizes = []
    for scene in (one, crowd):
        buffers = SceneBuffers(device, scene)
        deform = buffers.batches[0].deform
        assert deform is not None
        sizes.append({name: buffer.size for name, buffer in deform.buffers().items()})
        buffers.release()
    assert sizes[1].pop("DeformSpans") == 20 * sizes[0].pop("DeformSpans")
    assert sizes[0] == sizes[1]
    assert sizes[0]["MorphDeltas"] == 28 * 8  # of the vertices above the middle, 28 bytes each


def test_moving_scenes_of_any_scale_look_the_same(device: Device) -> None:
    """Joints are composed in double precision, so only what is left is rounded."""
    scene = dataclasses.replace(reed(), lights=())
    display = DisplayProfile.load(PAPER)
    pictures = []
    with Renderer(device) as renderer:
        for scale in (1.0, 2.0**-500, 2.0**500):
            size = np.diag([scale, scale, scale, 1.0])
            local = np.array(scene.nodes.parent_from_node)
            local[scene.nodes.parents < 0] = size @ local[scene.nodes.parents < 0]
            nodes = dataclasses.replace(scene.nodes, parent_from_node=local)
            leaf = dataclasses.replace(scene.instances[1], world_from_local=nodes.world()[2])
            sized = dataclasses.replace(scene, nodes=nodes, instances=(scene.instances[0], leaf))
            pose = Pose({"tip": turn(2, 0.4, translation=(0.0, 2.0, 0.0))})
            pictures.append(renderer.views(sized, display, pose=pose, **SMALL))
    assert pictures[0].std() > 20
    for other in pictures[1:]:
        np.testing.assert_array_equal(other, pictures[0])


def test_a_pose_too_far_for_single_precision_is_told(device: Device) -> None:
    scene = reed()
    far = Pose({"tip": np.array([[1, 0, 0, 1e300], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])})
    display = DisplayProfile.load(PAPER)
    with Renderer(device) as renderer:
        before = renderer.views(scene, display, reed_camera(display), **SMALL)
        with pytest.raises(SceneError, match="scene 'reed': joints or morph weights too"):
            renderer.views(scene, display, reed_camera(display), pose=far, **SMALL)
        after = renderer.views(scene, display, reed_camera(display), **SMALL)
    np.testing.assert_array_equal(after, before)

"""Vertices and normals against the reference, and how a scene is cut into batches."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from lfd_render.display import DisplayProfile, ViewGrid
from lfd_render.gpu import scene_buffers
from lfd_render.gpu.device import Device
from lfd_render.gpu.layout import dtype
from lfd_render.gpu.scene_buffers import SceneBuffers
from lfd_render.reference import Triangles, placed
from lfd_render.reference.transform import normals_by, points_by, unit
from lfd_render.scene import Image, Instance, Material, Mesh, Scene, TextureSlot

from .helpers import (
    PAPER,
    Passes,
    examples,
    mesh_of,
    passes,
    random_camera,
    random_scene,
    scene_of,
    soup,
)

pytestmark = pytest.mark.needs("gl")

seeds = st.integers(0, 2**32 - 1)
EPSILON = 2.0**-24
# Angle by which a unit vector is off after one rounding to 2 × snorm16: half a step δ of 1/32767 in
# x and in y moves z by up to 2δ, δ·√6 in all, on a face whose middle is 1/√3 from the origin.
OCTAHEDRAL_RAD = 18.0**0.5 * 0.5 / 32767.0


def directions(words: NDArray[np.uint32]) -> NDArray[np.float64]:
    """Unit vectors [n, 3] of octahedral words: x in the low half (Cigolle et al. 2014)."""
    flat = (
        np.stack([words & 0xFFFF, words >> 16], axis=1).astype(np.uint16).view(np.int16) / 32767.0
    )
    z = 1.0 - np.abs(flat).sum(axis=1)
    lower = (1.0 - np.abs(flat[:, ::-1])) * np.where(flat < 0.0, -1.0, 1.0)
    xy = np.where(z[:, None] < 0.0, lower, flat)
    return unit(np.column_stack([xy, z]))


def placed_by_device(opened: Passes) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions and unit normals of the corners of all triangles, [triangle, corner, xyz]."""
    normals = [
        directions(batch.display_vertices.read(np.uint32)[3::4])[
            batch.corners.read(np.uint32).reshape(-1, 4)[:, :3]
        ]
        for batch in opened.buffers.batches
    ]
    return opened.triangles().p_display, np.concatenate(normals)


def position_bounds(scene: Scene, display_from_world: NDArray[np.float64]) -> NDArray[np.float64]:
    """How far positions may be off, [triangle, corner, xyz]: a row of the matrix, rounded, times a
    point is four products and three sums, each off by ε of the sum of the products' sizes."""
    bounds = []
    for mode in ("opaque", "mask", "blend"):
        for instance in scene.instances:
            mesh = scene.meshes[instance.mesh]
            if scene.materials[mesh.material].alpha_mode == mode:
                matrix = np.abs(display_from_world @ instance.world_from_local)
                bounds.append(points_by(matrix, np.abs(mesh.positions))[mesh.triangles])
    return 5.0 * EPSILON * np.concatenate(bounds)


def normal_bounds(scene: Scene, triangles: Triangles) -> NDArray[np.float64]:
    """How far normals may be off, [triangle] rad: rounded, stretched by the placement, rounded."""
    stretches = np.array([np.linalg.cond(i.world_from_local[:3, :3]) for i in scene.instances])
    return OCTAHEDRAL_RAD * (1.0 + stretches[triangles.instance])


@examples(10)
@given(seed=seeds)
def test_vertices_go_where_the_matrices_say(device: Device, seed: int) -> None:
    rng = np.random.default_rng(seed)
    profile = DisplayProfile.load(PAPER)
    scene = random_scene(rng, profile, 40)
    display_from_world = random_camera(rng, profile.size_mm)
    grid = ViewGrid.upright(profile, 4, 3)
    expected = placed(scene, display_from_world)
    with passes(device, scene, profile.rig(1), grid, display_from_world) as opened:
        p_display, normals = placed_by_device(opened)
    off = np.abs(p_display - expected.p_display)
    assert np.all(off <= position_bounds(scene, display_from_world))
    angle = np.arccos(np.clip(np.sum(normals * expected.normals_world, axis=-1), -1.0, 1.0))
    assert np.all(angle <= normal_bounds(scene, expected)[:, None] + 1e-7)

    # Planted faults: a matrix the other way round, normals that go the way of points.
    transposed = placed(scene, _transposed(display_from_world))
    assert np.any(np.abs(p_display - transposed.p_display) > off.max() + 1.0)
    matrix = scene.instances[-1].world_from_local
    local = scene.meshes[scene.instances[-1].mesh].normals
    as_points = unit(local @ matrix[:3, :3].T)
    assert np.any(np.abs(as_points - normals_by(matrix, local)) > 0.01)


def _transposed(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    turned = matrix.copy()
    turned[:3, :3] = matrix[:3, :3].T
    return turned


def test_normals_survive_extreme_placements(device: Device) -> None:
    """Scales from 1e-6 to 1e6, and a placement that flattens: what it leaves faces along z."""
    profile = DisplayProfile.load(PAPER)
    corners = np.eye(3)[None] + 1.0
    normals = unit(np.array([[[0.0, 0.6, 0.8], [-0.6, 0.0, -0.8], [0.0, 0.0, -1.0]]]))
    matrices = [np.diag([s, s, s, 1.0]) for s in (1e-6, 1e-3, 1e3, 1e6)]
    matrices.append(np.diag([1.0, 1.0, 0.0, 1.0]))
    mesh = mesh_of(corners, normals=normals)
    instances = tuple(Instance(str(i), 0, matrix) for i, matrix in enumerate(matrices))
    scene = Scene("scaled", (mesh,), instances, (Material("plain"),))
    with passes(device, scene, profile.rig(1), ViewGrid.upright(profile, 4, 3)) as opened:
        _, found = placed_by_device(opened)
    expected = np.repeat(normals, len(matrices), axis=0)
    expected[-1] = unit(normals[0] * [0.0, 0.0, 1.0])
    angle = np.arccos(np.clip(np.sum(found * expected, axis=-1), -1.0, 1.0))
    assert np.all(angle <= 2.0 * OCTAHEDRAL_RAD + 1e-7)


# ---- batches ----------------------------------------------------------------------------------


@pytest.mark.parametrize("extras", [False, True])
@pytest.mark.parametrize("limit", ["BATCH_TRIANGLES", "BATCH_VERTICES"])
def test_a_mesh_larger_than_a_batch_is_cut(
    device: Device, rng: np.random.Generator, extras: bool, limit: str
) -> None:
    """A mesh of shared vertices, cut where no vertex order helps; triangles keep their order."""
    profile = DisplayProfile.load(PAPER)
    positions = rng.uniform(-100, 100, (60, 3)).astype(np.float32)
    triangles = rng.integers(0, 60, (200, 3)).astype(np.uint32)
    colors = rng.uniform(0, 1, (60, 4)) if extras else np.ones((60, 4))
    mesh = Mesh(
        "shared",
        positions,
        unit(rng.normal(size=(60, 3))).astype(np.float32),
        np.zeros((60, 2, 2), np.float32),
        colors.astype(np.float32),
        triangles,
        0,
    )
    scene = scene_of(mesh, mesh_of(soup(rng, 5, profile)))
    expected = placed(scene, np.eye(4))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(scene_buffers, limit, 36)
        with passes(device, scene, profile.rig(1), ViewGrid.upright(profile, 4, 3)) as opened:
            assert len(opened.batches) > 4
            bases = [batch.triangle_base for batch, _ in opened.batches]
            counts = [batch.triangles for batch, _ in opened.batches]
            p_display, normals = placed_by_device(opened)
    np.testing.assert_array_equal(bases, np.cumsum([0, *counts[:-1]]))
    np.testing.assert_array_equal(p_display, expected.p_display)  # the identity is exact
    cosine = np.sum(normals * expected.normals_world, axis=-1)
    assert np.all(np.arccos(np.clip(cosine, -1, 1)) <= 2.0 * OCTAHEDRAL_RAD + 1e-7)


@pytest.mark.parametrize("texcoord", [0, 1])
def test_a_second_coordinate_set_takes_room_only_where_it_is_read(
    device: Device, rng: np.random.Generator, texcoord: int
) -> None:
    corners = rng.uniform(-10.0, 10.0, (20, 3, 3))
    mesh = mesh_of(corners, texcoords=rng.uniform(0.1, 1.0, (20, 3, 2, 2)))
    image = Image("grey", np.full((2, 2, 4), 128, np.uint8))
    material = Material("textured", base_color_texture=TextureSlot(0, texcoord=texcoord))
    instance = Instance("textured", 0, np.eye(4))
    scene = Scene("textured", (mesh,), (instance,), (material,), (image,))
    buffers = SceneBuffers(device, scene)
    assert buffers.constants()["VERTEX_EXTRAS"] == texcoord
    assert buffers.batches[0].extras.size == dtype("VertexExtra").itemsize * (60 if texcoord else 1)
    buffers.release()

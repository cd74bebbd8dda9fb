"""The applications of the catalogue: ids, G-buffers and shadow maps, by its pipelines."""

import dataclasses

import numpy as np
import pytest
from numpy.typing import NDArray

from lfd_render.gpu.clock import StageClock
from lfd_render.gpu.device import Device
from lfd_render.gpu.scene_buffers import SceneBuffers
from lfd_render.passes.pipelines import PIPELINES
from lfd_render.passes.raster_depth import Spots
from lfd_render.reference import NO_TRIANGLE, placed
from lfd_render.reference.raster import Pixels, meet, rays
from lfd_render.scene import Instance, Material, Scene
from lfd_render.techniques.mvr_buffers import GBuffers, ShadowMaps

from .helpers import mesh_of, shifted
from .test_mvr import AT_REST, VIEWS, few_views, read_ids, standing
from .test_raster import judged

pytestmark = pytest.mark.needs("gl")

SOME = ("multipass", "multipass-partitioned", "instanced-4", "instanced-partitioned", "loop-4",
        "loop-4-partitioned", "invocations-4")  # fmt: skip


@pytest.mark.parametrize("name", SOME)
def test_ids_are_those_of_the_nearest_triangles(device: Device, name: str) -> None:
    scene, rig, grid = few_views(1)
    ids = read_ids(device, scene, rig, grid, PIPELINES[name], AT_REST).transpose(1, 0, 2)
    differ, unexplained = judged(ids, scene, rig, grid)
    assert differ <= 2 + 2e-3 * ids.size
    assert unexplained <= 2
    assert (ids != NO_TRIANGLE).mean() > 0.05


def colours(scene: Scene, rng: np.random.Generator) -> NDArray[np.float64]:
    """Random base colour, metallic and roughness of each material, in steps of half floats."""
    return np.asarray(rng.integers(0, 129, (len(scene.materials), 5)) / 128)


@pytest.mark.parametrize("name", SOME)
def test_g_buffers_hold_colour_normal_and_place(device: Device, name: str) -> None:
    scene, rig, grid = few_views(2)
    number = colours(scene, np.random.default_rng(5))
    scene = dataclasses.replace(
        scene,
        materials=tuple(
            dataclasses.replace(m, base_color=(*n[:3], 1.0), metallic=n[3], roughness=n[4])
            for m, n in zip(scene.materials, number, strict=True)
        ),
    )
    clock = StageClock(device)
    with standing(device, scene, rig, grid, AT_REST) as (buffers, target, placement):
        technique = GBuffers(device, buffers, target, pipeline=PIPELINES[name])
        technique.begin(placement, clock)
        technique.render(target.bands[0], clock)
        color, normal, place = technique.read(target.bands[0])
        technique.release()
    ids = read_ids(device, scene, rig, grid, PIPELINES[name], AT_REST)
    view, row, column = np.nonzero(ids != NO_TRIANGLE)
    shown = ids[view, row, column]
    at = view, row, column
    np.testing.assert_array_equal(place[..., 3], ids != NO_TRIANGLE)
    # unorm16 in the material, half floats in the buffer.
    np.testing.assert_allclose(color[at], number[shown][:, :4], atol=1e-3)
    np.testing.assert_allclose(normal[at][:, 3], number[shown][:, 4], atol=1e-3)
    # The mesh's normals point to the viewer; a side seen from behind turns them over.
    np.testing.assert_allclose(np.abs(normal[at][:, 2]), 1.0, atol=1e-3)

    corners = placed(scene, np.eye(4)).p_display[shown]
    through = rays(rig, grid, Pixels(row, view, column))
    met = meet(corners, through, rig.distance_mm)
    depth = rig.distance_mm - place[at][:, 2]
    # Snapping moves a triangle by up to 1/128 px, and a steep one's depth with it.
    assert np.median(np.abs(depth / met.depths - 1.0)) < 1e-4
    assert np.mean(np.abs(depth / met.depths - 1.0) < 0.02) > 0.97
    k = rig.distance_mm / depth
    x_mm = k * place[at][:, 0] + (1.0 - k) * through.eye_mm
    off_px = np.abs(x_mm - through.x_mm) / grid.column_mm
    assert np.quantile(off_px, 0.97) < 1 / 64


# ---- shadow maps ------------------------------------------------------------------------------


def square(z: float, half: float) -> NDArray[np.float64]:
    """Two triangles that face +z."""
    a, b, c, d = ([-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z])
    return np.array([[a, b, c], [a, c, d]])


def shadow_maps(
    device: Device, scene: Scene, spots: Spots, name: str, size: tuple[int, int]
) -> NDArray[np.float32]:
    held = device.ledger.total
    buffers = SceneBuffers(device, scene)
    maps = ShadowMaps(device, buffers, len(spots.eyes), size, pipeline=PIPELINES[name])
    maps.render(spots, StageClock(device))
    found = maps.read()
    for owner in (maps, buffers):
        owner.release()
    assert device.ledger.total == held
    return found


def room(count: int) -> tuple[Scene, Spots]:
    """Large triangles in a box, seen from both sides, and spots among them."""
    rng = np.random.default_rng(8)
    corners = rng.uniform(-1, 1, (160, 1, 3)) + rng.normal(scale=0.5, size=(160, 3, 3))
    material = Material("both", double_sided=True)
    scene = Scene("room", (mesh_of(corners),), (Instance("it", 0, np.eye(4)),), (material,))
    return scene, Spots.scattered(scene.bounds(), count, seed=3)


def nearest_by_rays(scene: Scene, spots: Spots, size: int) -> NDArray[np.float64]:
    """Depths [spot, y, x] where rays through the texels' centres first meet a triangle."""
    (mesh,) = scene.meshes
    corners = mesh.positions.astype(np.float64)[mesh.triangles]
    centres = (np.arange(size) + 0.5) / size * 2.0 - 1.0
    x, y = np.meshgrid(centres, centres)
    found = np.full((len(spots.eyes), size, size), np.inf)
    for eye, clip, depths in zip(spots.eyes, spots.clip_from_world(), found, strict=True):
        # Rays of depth 1: of rows x, y and w of the matrix they have x, y and 1.
        direction = np.stack([x, y, np.ones_like(x)], -1) @ np.linalg.inv(clip[[0, 1, 3], :3]).T
        for a, b, c in corners:
            across = np.cross(direction, c - a)
            determinant = across @ (b - a)
            u = across @ (eye - a) / determinant
            along = np.cross(eye - a, b - a)
            v, depth = direction @ along / determinant, (c - a) @ along / determinant
            hit = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (depth >= spots.near)
            depths[hit] = np.minimum(depths, depth)[hit]
    return found


@pytest.mark.parametrize("name", SOME)
def test_shadow_maps_hold_the_nearest_depths(device: Device, name: str) -> None:
    scene, spots = room(VIEWS)
    found = shadow_maps(device, scene, spots, name, (40, 40))
    expected = nearest_by_rays(scene, spots, 40)
    assert np.isfinite(found).mean() > 0.2
    assert mistaken(found, expected) < 1e-3  # edges; none of 9,600 measured
    assert mistaken(np.roll(found, 1, axis=0), expected) > 0.1  # of the spot before


def mistaken(found: NDArray[np.float32], expected: NDArray[np.float64]) -> float:
    """Share of texels that see another depth, or see nothing."""
    with np.errstate(invalid="ignore"):
        same = (found == expected) | (np.abs(found / expected - 1.0) < 1e-3)
    return float(np.mean(~same))


def test_a_floor_below_a_lamp_has_its_distance_and_a_screen_casts_a_shadow(device: Device) -> None:
    """Row 0 of a map is the top: what stands to the world's +y is in the upper half."""
    corners = np.concatenate([square(0.0, 50.0), shifted(square(4.0, 1.0), 0.0, 3.0, 0.0)])
    scene = Scene(
        "floor", (mesh_of(corners),), (Instance("it", 0, np.eye(4)),), (Material("plain"),)
    )
    spots = Spots(np.array([[0.0, 0.0, 10.0]]), np.array([[0.0, 0.0, -2.0]]), np.pi / 2, 0.1)
    (depth,) = shadow_maps(device, scene, spots, "multipass", (60, 60))
    assert set(np.unique(depth.round(2))) == {6.0, 10.0}
    row, column = np.nonzero(depth < 8.0)
    # 1 at z = 4 is 5 texels of 60 across 90°, and 3 is 15.
    assert (row.min(), row.max()) == (10, 19)
    assert (column.min(), column.max()) == (25, 34)

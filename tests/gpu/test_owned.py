"""Splatting without atomics finds the winners that atomics find, to the bit.

`test_splat` holds the latter to visibility's definition. Rows that hold more than a dispatch takes,
points in any order, and bins that outgrow their room are this path's own.
"""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lfd_render.display import DisplayProfile, ViewGrid
from lfd_render.errors import GpuError
from lfd_render.gpu.clock import StageClock
from lfd_render.gpu.device import Device
from lfd_render.gpu.layout import dtype
from lfd_render.gpu.scene_buffers import SceneBuffers
from lfd_render.passes import bin as bin_pass
from lfd_render.passes import owned, view_target
from lfd_render.passes.placement import Placement
from lfd_render.passes.sample import Sample
from lfd_render.passes.view_buffers import INT64, INT64_ATOMICS, choose_winners
from lfd_render.passes.view_target import ViewTarget
from lfd_render.renderer import Renderer
from lfd_render.scene import Material, Scene
from lfd_render.techniques import Lfdpr

from .helpers import PAPER, Winners, examples, mesh_of, random_grid, random_scene, scene_of
from .test_splat import assert_same, divided

pytestmark = pytest.mark.needs("gl")

seeds = st.integers(0, 2**32 - 1)


def same(a: Winners, b: Winners) -> bool:
    try:
        assert_same(a, b)
    except AssertionError:
        return False
    return True


@examples(4)
@given(seed=seeds, views=st.sampled_from([1, 7, 70]))
def test_winners_are_those_of_atomics(device: Device, seed: int, views: int) -> None:
    rng = np.random.default_rng(seed)
    profile, grid = random_grid(rng, PAPER)
    rig, scene = profile.rig(views), random_scene(rng, profile, 30)
    found = divided(device, scene, rig, grid, winners="owned")
    assert_same(found, divided(device, scene, rig, grid, winners="two-pass"))
    if INT64_ATOMICS in device.info.extensions:  # under zink, by test_int64
        assert_same(found, divided(device, scene, rig, grid, winners="int64"))


@examples(3)
@given(seed=seeds, most_iterations=st.sampled_from([1, 60, 500]))
def test_winners_do_not_depend_on_the_division_of_work(
    device: Device, seed: int, most_iterations: int
) -> None:
    rng = np.random.default_rng(seed)
    profile = DisplayProfile.load(PAPER)
    rig, grid = profile.rig(7), ViewGrid.upright(profile, 40, 30)
    scene = random_scene(rng, profile, 30)
    whole = divided(device, scene, rig, grid, winners="two-pass")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(owned, "MOST_ITERATIONS", most_iterations)
        for parts in (
            {},
            {"band_rows": 7},
            {"window_items": 17},
            {"band_rows": 4, "window_items": 5, "batch_triangles": 29},
        ):
            assert_same(whole, divided(device, scene, rig, grid, winners="owned", **parts))


@examples(3)
@given(seed=seeds)
def test_winners_do_not_depend_on_the_order_of_points(device: Device, seed: int) -> None:
    rng = np.random.default_rng(seed)
    profile = DisplayProfile.load(PAPER)
    rig, grid = profile.rig(7), ViewGrid.upright(profile, 40, 30)
    scene = random_scene(rng, profile, 30)
    written = Sample.fill

    def shuffled(self: Sample, batch, points, band, window) -> None:
        written(self, batch, points, band, window)
        count = int(points.work.read(dtype("Work"))[window]["items"])
        rows = rng.permutation(points.rows.read(dtype("PointRow"))[:count])
        if points.bins:  # within those
            rows = rows[np.argsort(rows["row_sides"] & 0xFFFF, kind="stable")]
        points.rows.write(rows)

    for winners in ("owned", "two-pass"):
        straight = divided(device, scene, rig, grid, winners=winners)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(Sample, "fill", shuffled)
            assert_same(straight, divided(device, scene, rig, grid, winners=winners))


def walls(
    profile: DisplayProfile, foot_mm: float | np.ndarray, x_mm: np.ndarray, z_mm: np.ndarray
) -> Scene:
    """Triangles with a foot so wide, far below the window, and a tip far above it."""
    corners = np.zeros((len(x_mm), 3, 3))
    corners[..., 0] = x_mm[:, None] + np.array([-0.5, 0.5, 0.0]) * np.reshape(foot_mm, (-1, 1))
    corners[..., 1] = np.array([-9, -9, 9]) * profile.size_mm[1]
    corners[..., 2] = z_mm[:, None]
    return scene_of(mesh_of(corners), materials=(Material("both", double_sided=True),))


def test_rows_longer_than_a_device_loops_are_splatted_whole(
    device: Device, rng: np.random.Generator
) -> None:
    profile = DisplayProfile.load(PAPER)
    rig, grid = profile.rig(3), ViewGrid.upright(profile, 500, 3)
    # Stairs: from left to right each wall is a column wider than the one before it, and shows its
    # last columns, which are lost where a loop ends early. In all a bin has 120,000.
    order = rng.permutation(490)
    wide_mm = (1.0 + order) * grid.column_mm
    x_mm = 0.5 * (wide_mm - profile.size_mm[0])
    scene = walls(profile, 2.0 * wide_mm, x_mm, -1e-3 * order)
    expected = divided(device, scene, rig, grid, winners="two-pass")
    assert len(np.unique(expected.solid)) > 400
    assert_same(expected, divided(device, scene, rig, grid, winners="owned"))


@pytest.mark.parametrize("columns", [1364, 1365, 1820])
def test_items_as_wide_as_views_leave_none_out(device: Device, columns: int) -> None:
    """Three views a lane, and alpha tested, a round takes a few such items, or one fewer."""
    profile = DisplayProfile.load(PAPER)
    rig, grid = profile.rig(24), ViewGrid.upright(profile, columns, 3)
    # Walls that touch a parabola, each nearest about its own place.
    place_mm = np.linspace(-0.4, 0.4, 16) * profile.size_mm[0]
    corners = np.zeros((len(place_mm), 3, 3))
    corners[..., 0] = np.array([-40, 40, 0]) * profile.size_mm[0]
    corners[..., 1] = np.array([-9, -9, 9]) * profile.size_mm[1]
    corners[..., 2] = 2e-4 * place_mm[:, None] * (2 * corners[..., 0] - place_mm[:, None])
    scene = scene_of(
        mesh_of(corners), materials=(Material("cut", double_sided=True, alpha_mode="mask"),)
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bin_pass, "_HEADROOM", 1)
        found = divided(device, scene, rig, grid, winners="owned")
    assert_same(found, divided(device, scene, rig, grid, winners="two-pass"))
    assert len(np.unique(found.solid)) == len(place_mm)


def test_a_dispatch_left_out_is_seen(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    profile = DisplayProfile.load(PAPER)
    rig, grid = profile.rig(3), ViewGrid.upright(profile, 500, 3)
    # Each wall is two columns wide and alone in its place, so that each row of points shows.
    x_mm = np.linspace(-0.4, 0.4, 40) * profile.size_mm[0]
    scene = walls(profile, 4 * grid.column_mm, x_mm, np.zeros(40))
    monkeypatch.setattr(owned, "MOST_ITERATIONS", 1)
    monkeypatch.setattr(bin_pass, "_HEADROOM", 1)
    expected = divided(device, scene, rig, grid, winners="two-pass")
    assert len(np.unique(expected.solid)) == 41  # and the background
    assert same(expected, divided(device, scene, rig, grid, winners="owned"))
    monkeypatch.setattr(owned, "iterations_left", lambda each: 2)  # each round takes one of them
    assert not same(expected, divided(device, scene, rig, grid, winners="owned"))


def test_a_frame_that_outgrows_its_bins_says_so(device: Device, rng: np.random.Generator) -> None:
    profile = DisplayProfile.load(PAPER)
    rig, grid = profile.rig(7), ViewGrid.upright(profile, 40, 30)
    buffers = SceneBuffers(device, random_scene(rng, profile, 60))
    buffers.lighting.use("studio", turn_rad=0.0, intensity=1.0)
    target = ViewTarget(device, rig, grid, buffers.batches)
    technique = Lfdpr(device, buffers, target, winners="owned")
    clock = StageClock(device)
    technique.begin(Placement(np.eye(4), (0.0, 0.0, 0.0)), clock)
    technique.warm_up(clock)

    def words() -> np.ndarray:
        technique.render(target.bands[0], clock)
        return technique._views.words.read(np.uint32)

    expected = words()
    assert technique.complete()
    for points in technique._points:
        points.bins.room = 0
    assert (words() != expected).any()
    assert not technique.complete()
    np.testing.assert_array_equal(words(), expected)
    assert technique.complete()
    technique.release()
    buffers.release()


def test_pictures_are_the_same(device: Device) -> None:
    display = DisplayProfile.load(PAPER)
    scene = Scene.load("builtin:spheres?triangles=3000")
    found = {}
    with Renderer(device) as renderer:
        for splat in ("owned", "two-pass"):
            eia = renderer.render(scene, display, views=5, view_size=(60, 45), splat=splat)
            assert eia.report["splat"] == splat
            found[splat] = eia.pixels
    assert found["owned"].std() > 5
    np.testing.assert_array_equal(found["owned"], found["two-pass"])


def test_the_largest_band_fits_a_buffer(device: Device) -> None:
    assert device.info.max_storage_bytes >= 2 * view_target.BAND_BYTES


@pytest.mark.parametrize("count", [1, 2, 3, 8, 360, 361, 1000])
def test_strides_visit_every_row(count: int) -> None:
    visited = np.arange(count) * owned.coprime_stride(count) % count
    assert sorted(visited) == list(range(count))


def test_what_suits_the_device_is_chosen(device: Device) -> None:
    for extensions in ((), (INT64,), (INT64, INT64_ATOMICS)):
        for software in (False, True):
            info = dataclasses.replace(
                device.info, software=software, extensions=frozenset(extensions)
            )
            other = SimpleNamespace(info=info, name="other")
            owned_ones = software and INT64 in extensions
            expected = (
                "int64" if INT64_ATOMICS in extensions else "owned" if owned_ones else "two-pass"
            )
            assert choose_winners(other, "auto") == expected
            assert choose_winners(other, "auto", ownable=False) == expected.replace(
                "owned", "two-pass"
            )
            assert choose_winners(other, "two-pass") == "two-pass"


def test_a_device_without_64_bit_words_says_so(device: Device) -> None:
    info = dataclasses.replace(device.info, extensions=frozenset())
    with pytest.raises(GpuError, match=f"owned': other lacks {INT64}; use two-pass"):
        choose_winners(SimpleNamespace(info=info, name="other"), "owned")


def test_a_device_without_64_bit_atomics_says_so(device: Device) -> None:
    if INT64_ATOMICS in device.info.extensions:
        assert choose_winners(device, "int64") == choose_winners(device, "auto") == "int64"
        return
    with pytest.raises(GpuError, match=f"{INT64_ATOMICS}; use two-pass"):
        choose_winners(device, "int64")

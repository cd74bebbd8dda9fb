"""The catalogue of multi-view rasterisation: every variant against visibility by its definition,
and against each other."""

import dataclasses
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from unittest.mock import patch

import numpy as np
import pytest
from numpy.typing import NDArray

from lfd_render.display import DisplayProfile, Rig, ViewGrid
from lfd_render.errors import GpuError, UsageError
from lfd_render.gpu import raw as gl
from lfd_render.gpu.clock import StageClock
from lfd_render.gpu.device import Device
from lfd_render.gpu.scene_buffers import SceneBuffers
from lfd_render.passes import pipelines, raster, view_target
from lfd_render.passes.pipelines import PIPELINES, Pipeline
from lfd_render.passes.placement import Placement
from lfd_render.passes.view_target import ViewTarget
from lfd_render.reference import NO_TRIANGLE
from lfd_render.renderer import RenderOptions
from lfd_render.scene import Pose, Scene
from lfd_render.techniques.mvr import VARIANTS, make_mvr, notation, problem, supported
from lfd_render.techniques.mvr_buffers import IdBuffers

from .helpers import FULL, PAPER, passes, random_camera, random_scene
from .moving import random_moving
from .test_raster import judged, random_views

pytestmark = pytest.mark.needs("gl")

VIEWS = 6  # which four do not divide
# A pixel of a sliver may be off, whose plane turns when its corners are snapped; none was measured.
FEW = 2


@dataclasses.dataclass(frozen=True, eq=False)
class Before:
    """How a scene stands before the display."""

    display_from_world: NDArray[np.float64]
    pose: Pose | None = None


AT_REST = Before(np.eye(4))


@contextmanager
def standing(
    device: Device, scene: Scene, rig: Rig, grid: ViewGrid, before: Before
) -> Iterator[tuple[SceneBuffers, ViewTarget, Placement]]:
    """The scene on the device, which holds what it held at the end."""
    held = device.ledger.total
    buffers = SceneBuffers(device, scene)
    buffers.pose(before.pose)
    target = ViewTarget(device, rig, grid, buffers.batches)
    yield buffers, target, Placement(before.display_from_world, (0.0, 0.0, 0.0))
    buffers.release()
    assert device.ledger.total == held


def rendered(
    device: Device, scene: Scene, rig: Rig, grid: ViewGrid, variant: str, before: Before = AT_REST
) -> NDArray[np.float64]:
    """Images [view, row, column, rgb] by a variant."""
    found, clock = [], StageClock(device)
    with standing(device, scene, rig, grid, before) as (buffers, target, placement):
        technique = make_mvr(device, buffers, target, variant=variant)
        technique.begin(placement, clock)
        for band in target.bands:
            technique.render(band, clock)
            found.append(target.images.read(np.float16, gl.HALF_FLOAT)[:, : band.rows, :, :3])
        technique.release()
    return np.concatenate(found, axis=1).astype(np.float64)


def read_ids(
    device: Device, scene: Scene, rig: Rig, grid: ViewGrid, pipeline: Pipeline, before: Before
) -> NDArray[np.uint32]:
    """Ids [view, row, column] by a pipeline."""
    found, clock = [], StageClock(device)
    with standing(device, scene, rig, grid, before) as (buffers, target, placement):
        technique = IdBuffers(device, buffers, target, pipeline=pipeline)
        technique.begin(placement, clock)
        for band in target.bands:
            technique.render(band, clock)
            found.append(technique.read(band))
        technique.release()
    return np.concatenate(found, axis=1)


def ids_of(images: NDArray[np.float64]) -> NDArray[np.uint32]:
    """Ids [row, view, column] of a `coloured` scene."""
    number = np.rint(images[..., 0] * 256).astype(np.int64)
    return np.where(number > 0, number - 1, NO_TRIANGLE).astype(np.uint32).transpose(1, 0, 2)


def few_views(seed: int) -> tuple[Scene, Rig, ViewGrid]:
    """As `random_views`, of VIEWS views."""
    scene, rig, grid = random_views(seed)
    eyes = np.linspace(rig.eye_x_mm[0], rig.eye_x_mm[-1], VIEWS)
    return scene, dataclasses.replace(rig, eye_x_mm=eyes), grid


def able(device: Device, variant: str) -> None:
    if why := problem(device, variant, VIEWS):
        pytest.skip(f"[mvr] {why}")


@pytest.mark.shows("variants of mvr see the nearest triangles outside 1/128 px of an edge")
@pytest.mark.parametrize("variant", VARIANTS)
def test_variants_see_the_nearest_triangles(
    device: Device, variant: str, measured: Callable[[str, str], None]
) -> None:
    able(device, variant)
    for seed in (1, 2) if FULL else (1 + VARIANTS.index(variant) % 2,):
        scene, rig, grid = few_views(seed)  # along the lenses, and upright
        found = ids_of(rendered(device, scene, rig, grid, variant))
        differ, unexplained = judged(found, scene, rig, grid)
        measured(f"{variant}, {grid.kind}", f"{differ} of {found.size} on edges, {unexplained} off")
        assert differ <= 2 + 2e-3 * found.size  # 0.07 % measured
        assert unexplained <= FEW
        assert (found != NO_TRIANGLE).mean() > 0.05


@dataclasses.dataclass(frozen=True, eq=False)
class Alike:
    """A scene of all kinds of materials, and what plain rasterisation and LFDPR make of it."""

    scene: Scene
    pose: Pose | None
    rig: Rig
    grid: ViewGrid
    display_from_world: NDArray[np.float64]
    plain: NDArray[np.float64]  # [view, row, column, rgb]
    plain_ids: NDArray[np.uint32]  # [view, row, column]
    lfdpr: NDArray[np.float64]
    lfdpr_ids: NDArray[np.uint32]

    def ids(self, device: Device, pipeline: Pipeline) -> NDArray[np.uint32]:
        """Ids [view, row, column] by a pipeline."""
        return read_ids(device, self.scene, self.rig, self.grid, pipeline, self._before)

    def images(self, device: Device, variant: str) -> NDArray[np.float64]:
        """Images by a variant."""
        return rendered(device, self.scene, self.rig, self.grid, variant, self._before)

    @property
    def _before(self) -> "Before":
        return Before(self.display_from_world, self.pose)


def masked(scene: Scene) -> Scene:
    """The scene with masks for blended materials: one id a pixel says all of it."""
    materials = (
        dataclasses.replace(m, alpha_mode="mask") if m.alpha_mode == "blend" else m
        for m in scene.materials
    )
    return dataclasses.replace(scene, materials=tuple(materials))


@pytest.fixture(scope="module", params=["still", "moving"])
def alike(device: Device, request: pytest.FixtureRequest) -> Alike:
    """Instances, mirrored too, textures, masks, vertex colours; or morph targets and joints."""
    rng = np.random.default_rng(1)
    profile = DisplayProfile.load(PAPER)
    rig, grid = profile.rig(VIEWS), ViewGrid.upright(profile, 96, 72)
    scene, pose, matrix = random_scene(rng, profile, 60), None, np.eye(4)
    if request.param == "moving":
        scene, pose = random_moving(rng)
        matrix = random_camera(rng, rig.panel_mm)
    scene = masked(scene)
    with passes(device, scene, rig, grid, matrix, pose=pose) as points:
        lfdpr, lfdpr_ids = points.images(), points.winners().solid.transpose(1, 0, 2)
    before = Before(matrix, pose)
    plain = rendered(device, scene, rig, grid, "multipass", before)
    plain_ids = read_ids(device, scene, rig, grid, PIPELINES["multipass"], before)
    return Alike(scene, pose, rig, grid, matrix, plain, plain_ids, lfdpr, lfdpr_ids)


@pytest.mark.parametrize("name", PIPELINES)
def test_variants_shade_alike(device: Device, alike: Alike, name: str) -> None:
    able(device, name)
    ids = alike.ids(device, PIPELINES[name])
    same = ids == alike.plain_ids
    assert same.mean() > 1 - 5e-4  # 7e-5 measured over six scenes
    assert (ids != NO_TRIANGLE).mean() > 0.05

    forward = alike.images(device, name)
    # Parts of a texture round positions and so derivatives in their own way: 4 steps of the half
    # floats measured.
    off = np.abs(forward - alike.plain).max(axis=-1) / (alike.plain.max(axis=-1) + 1e-3)
    assert off[same].max() < 0.01

    deferred = alike.images(device, name + "-deferred")
    # Forward shading takes derivatives between pixels, and at edges extrapolates. 0.1 % measured.
    off = np.abs(deferred - alike.plain).max(axis=-1) / (alike.plain.max(axis=-1) + 1e-3)
    assert np.mean(off[same] > 0.01) < 3e-3
    shared = ids == alike.lfdpr_ids
    assert shared.mean() > 1 - 2e-3  # 1.7e-4 measured
    np.testing.assert_array_equal(deferred[shared], alike.lfdpr[shared])


@pytest.mark.parametrize("variant", ["instanced", "instanced-partitioned", "loop-4"])
@pytest.mark.parametrize("shading", ["", "-deferred"])
def test_blended_surfaces_lie_over_solid_ones(device: Device, variant: str, shading: str) -> None:
    profile = DisplayProfile.load(PAPER)
    rig, grid = profile.rig(VIEWS), ViewGrid.upright(profile, 64, 48)
    scene = random_scene(np.random.default_rng(2), profile, 40)
    plain = rendered(device, scene, rig, grid, "multipass")
    found = rendered(device, scene, rig, grid, variant + shading)
    without = rendered(device, masked(scene), rig, grid, "multipass")
    assert np.mean(np.abs(found - plain).max(axis=-1) > 0.02) < 3e-3  # edges; 0.06 % measured
    assert np.mean(np.abs(without - plain).max(axis=-1) > 0.02) > 0.02  # and glass is seen


@pytest.mark.parametrize("variant", ["multipass", "instanced-partitioned", "loop-4-deferred"])
def test_bands_of_views_join(device: Device, variant: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scene, rig, grid = few_views(1)
    whole = rendered(device, scene, rig, grid, variant)
    monkeypatch.setattr(view_target, "BAND_BYTES", 7 * 4 * VIEWS * grid.columns)
    divided = rendered(device, scene, rig, grid, variant)
    # Clipping at a band's edge and the band's own raster move edges within a snap.
    assert np.mean((whole != divided).any(axis=-1)) < 5e-3


# ---- planted faults ---------------------------------------------------------------------------


def unexplained_by(device: Device, variant: str) -> int:
    scene, rig, grid = few_views(1)
    return judged(ids_of(rendered(device, scene, rig, grid, variant)), scene, rig, grid)[1]


def test_a_view_left_out_is_caught(device: Device) -> None:
    original = Pipeline.passes

    def short(pipeline: Pipeline, views: int) -> list[range]:
        return original(pipeline, views)[:-1]

    with patch.object(Pipeline, "passes", short):
        assert unexplained_by(device, "loop-4") > 10 * FEW


def test_mirrored_views_are_caught(device: Device) -> None:
    original = raster.band_views

    def mirrored(*arguments: object) -> NDArray[np.void]:
        return original(*arguments)[::-1].copy()  # type: ignore[arg-type]

    with patch.object(raster, "band_views", mirrored):
        assert unexplained_by(device, "instanced-deferred") > 10 * FEW


@pytest.mark.parametrize("variant", ["instanced-partitioned", "instanced-4-partitioned-deferred"])
def test_neighbours_that_bleed_are_caught(device: Device, variant: str) -> None:
    """Without the planes at the sides of their parts, views draw into each other's."""
    with patch.object(raster, "_PARTITION_CLIPS", 2):
        assert unexplained_by(device, variant) > 10 * FEW


def test_fragments_outside_their_part_are_caught(device: Device) -> None:
    unclipped = dataclasses.replace(PIPELINES["loop-partitioned"], clipping="")
    with patch.dict(pipelines.PIPELINES, {"loop-partitioned": unclipped}):
        assert unexplained_by(device, "loop-partitioned") > 10 * FEW


# ---- what devices can -------------------------------------------------------------------------


def test_names_and_notation() -> None:
    assert len(VARIANTS) == len(set(VARIANTS)) == 2 * len(PIPELINES)
    assert notation("multipass") == "P(N, →, □-□)"
    assert notation("multipass-partitioned") == "P(N, →, ⊞, CLIP_VP)"
    assert notation("instanced-partitioned") == "P(1, ≡, ⊞, CLIP_||)"
    assert notation("loop-partitioned") == "P(1, ⋈, ⊞, VFC_GS|CLIP_FS)"
    assert notation("invocations-4-deferred") == "P(⌈N/4⌉, ⇀, ⊟-⊟, VFC_GS|BFC_GS) + deferred"
    assert notation("multiview-2") == "P(⌈N/2⌉, ≈, ⊟-⊟)"


def test_passes_cover_the_views_and_are_as_long_where_drivers_want_it() -> None:
    for pipeline in PIPELINES.values():
        for views in range(4, 12):
            passes = pipeline.passes(views)
            assert set().union(*passes) == set(range(views))
            if pipeline.amplification == "multiview":
                assert {len(p) for p in passes} == {pipeline.at_once}


def test_devices_say_what_they_lack(device: Device) -> None:
    class Poor:
        name = "poor"
        info = dataclasses.replace(
            device.info, extensions=frozenset(), geometry_storage=False, max_geometry_vertices=24
        )

    poor: Device = Poor()  # type: ignore[assignment]
    left = supported(poor, 48)
    assert {name.removesuffix("-deferred") for name in left} == {
        "multipass", "multipass-partitioned", "instanced-partitioned", "instanced-4-partitioned",
    }  # fmt: skip
    for variant in set(VARIANTS) - set(left):
        why = problem(poor, variant, 48)
        assert why is not None
        assert "poor" in why
        assert why.rpartition("use ")[2].split(", ")[-1].split(" or ")[-1] in VARIANTS
    twin = Poor()
    twin.info = dataclasses.replace(device.info, max_multiview=2)  # type: ignore[misc]
    assert problem(twin, "multiview-2", 48) is None  # type: ignore[arg-type]
    assert str(problem(twin, "multiview-4", 48)).endswith("use multiview-2")  # type: ignore[arg-type]
    assert "fewer" in str(problem(twin, "multiview-2", 1))  # type: ignore[arg-type]
    assert problem(device, "invocations", device.info.max_geometry_invocations + 1)
    assert problem(device, "loop", 1024)
    assert problem(device, "loop-4", 1024) is None


def test_what_a_device_cannot_is_refused_before_anything_is_drawn(device: Device) -> None:
    scene, rig, grid = few_views(1)
    many = dataclasses.replace(rig, eye_x_mm=np.linspace(-50.0, 50.0, 400))
    with pytest.raises(GpuError, match=r"^mvr 'invocations': .* use invocations-4$"):
        rendered(device, scene, many, grid, "invocations")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"technique": "mvr", "mvr": "loops"}, "mvr 'loops': unknown; use multipass, "),
        ({"technique": "mvr", "mvr": None}, "mvr None: unknown"),
        ({"mvr": "loop-4"}, "mvr 'loop-4': technique 'lfdpr' rasterises no views"),
    ],
)
def test_bad_choices_are_named(options: dict[str, str], message: str) -> None:
    with pytest.raises(UsageError, match=f"^{message}"):
        RenderOptions(**options)  # type: ignore[arg-type]

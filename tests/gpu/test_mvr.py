"""The catalogue of multi-view rasterisation: every variant against visibility by its definition,
and against each other."""

import dataclasses
from unittest.mock import patch

import numpy as np
import pytest
from numpy.typing import NDArray

from lfd_render.display import Rig, ViewGrid
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

from .test_raster import judged, random_views

pytestmark = pytest.mark.needs("gl")

VIEWS = 6  # which four do not divide
# A pixel of a sliver may be off, whose plane turns when its corners are snapped; none was measured.
FEW = 2


def rendered(
    device: Device,
    scene: Scene,
    rig: Rig,
    grid: ViewGrid,
    variant: str,
    *,
    display_from_world: NDArray[np.float64] | None = None,
    pose: Pose | None = None,
    lod: str = "area",
) -> NDArray[np.float64]:
    """Images [view, row, column, rgb] by a variant."""
    before = device.ledger.total
    buffers = SceneBuffers(device, scene)
    buffers.pose(pose)
    target = ViewTarget(device, rig, grid, buffers.batches)
    technique = make_mvr(device, buffers, target, variant=variant, lod=lod)
    matrix = np.eye(4) if display_from_world is None else display_from_world
    clock = StageClock(device)
    technique.begin(Placement(matrix, (0.0, 0.0, 0.0)), clock)
    found = []
    for band in target.bands:
        technique.render(band, clock)
        found.append(target.images.read(np.float16, gl.HALF_FLOAT)[:, : band.rows, :, :3])
    for owner in (technique, buffers):
        owner.release()
    assert device.ledger.total == before
    return np.concatenate(found, axis=1).astype(np.float64)


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


@pytest.mark.parametrize("variant", VARIANTS)
def test_variants_see_the_nearest_triangles(device: Device, variant: str) -> None:
    able(device, variant)
    for seed in (1, 2):  # upright and along the lenses
        scene, rig, grid = few_views(seed)
        found = ids_of(rendered(device, scene, rig, grid, variant))
        differ, unexplained = judged(found, scene, rig, grid)
        assert differ <= 2 + 2e-3 * found.size
        assert unexplained <= FEW
        assert (found != NO_TRIANGLE).mean() > 0.05


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

"""Supersampled, continuous and gold views: averages are averages, and bands leave no seam."""

from typing import Any

import numpy as np
import pytest

from lfd_render.display import DisplayProfile, Rig, ViewGrid, slot_from_eye
from lfd_render.errors import UsageError
from lfd_render.gpu import raw as gl
from lfd_render.gpu.device import Device
from lfd_render.passes import view_target
from lfd_render.passes.average import Average
from lfd_render.passes.view_target import ViewTarget
from lfd_render.reference import woven
from lfd_render.reference.encode import encoded
from lfd_render.renderer import Renderer, RenderOptions
from lfd_render.renderer.plan import plan_panel
from lfd_render.scene import Material, Scene

from .helpers import PAPER, few_lenses, fill, mesh_of, millimetre_camera, scene_of

pytestmark = pytest.mark.needs("gl")


@pytest.fixture(scope="module")
def scene() -> Scene:
    return Scene.load("builtin:gallery?triangles=2000")


@pytest.fixture(scope="module")
def small() -> DisplayProfile:
    """The paper's lenses, fewer of them, on few pixels."""
    return few_lenses(PAPER, 40.3, (320, 180))


def test_pixels_are_means_of_their_samples(device: Device, rng: np.random.Generator) -> None:
    profile = few_lenses(PAPER, 11.3, (90, 60))
    grid = ViewGrid.lens(profile, 8).finer(profile, 3)
    target = ViewTarget(device, profile.rig(6), grid, [], row_step=3)
    average = Average(device, target, eyes=2, times=3)
    images = rng.uniform(0.0, 1.0, (6, grid.rows, grid.columns, 3)).astype(np.float16)
    fill(device, target.images, images)
    average(target.bands[0])
    found = average.images.read(np.float16, gl.HALF_FLOAT)[..., :3].astype(np.float64)
    parts = images.astype(np.float64).reshape(3, 2, 8, 3, grid.columns // 3, 3, 3)
    # A step of half floats below 1, since llvmpipe cuts where others round.
    np.testing.assert_allclose(found, parts.mean(axis=(1, 3, 5)), atol=2.0**-11)
    average.release()
    target.release()


@pytest.mark.parametrize("technique", ["lfdpr", "mvr"])
@pytest.mark.parametrize("supersample", [(2, 1), (1, 2), (3, 2)])
def test_supersampled_views_are_means_of_fine_ones(
    renderer: Renderer, scene: Scene, small: DisplayProfile, technique: str, supersample: Any
) -> None:
    fineness, eyes = supersample
    options = {"technique": technique, "exposure": 0.05}  # dark, where codes are nearly light
    found = renderer.views(
        scene, small, views=3, view_size=(40, 24), seed=5, supersample=supersample, **options
    )
    rig = Rig.jittered(small, 3, eyes, 5) if eyes > 1 else small.rig(3)
    fine = renderer.views(
        scene, small, rig=rig, view_size=(40 * fineness, 24 * fineness), **options
    )
    codes = fine / 255.0
    light = np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)
    parts = light.reshape(3, eyes, 24, fineness, 40, fineness, 3)
    wanted = encoded(parts.mean(axis=(1, 3, 5)), 1.0).astype(int)
    # Fine codes were rounded, and are light as it is only below the shoulder of the tone curve.
    dim = parts.max(axis=(1, 3, 5)) < 0.8
    assert dim.mean() > 0.9
    assert np.abs(found.astype(int) - wanted)[dim].max() <= 2
    plain = renderer.views(scene, small, views=3, view_size=(40, 24), **options).astype(int)
    assert np.abs(found - plain).mean() > 0.5  # planted fault: not supersampled at all


@pytest.mark.parametrize("options", [{}, {"technique": "mvr"}, {"projection": "general"}])
def test_lenses_cut_off_by_the_window_are_sampled_whole(
    renderer: Renderer, small: DisplayProfile, options: dict[str, Any]
) -> None:
    """A wall that fills the window fills the panel, however many samples a lens has."""
    wall = scene_of(
        mesh_of(np.array([[[-999, -999, 0], [999, -999, 0], [0, 1999, 0]]], float)),
        materials=(Material("wall", (0.5, 0.5, 0.5, 1.0), unlit=True, double_sided=True),),
    )
    camera = millimetre_camera(small.size_mm)
    eia = renderer.render(wall, small, camera, 6, supersample=(5, 1), **options)
    # Half floats are cut; a sample of background in 25 would be seven levels.
    assert np.ptp(eia.pixels.astype(int)) <= 1
    assert eia.pixels.min() > 180


def test_eyes_of_a_view_stay_in_its_interval() -> None:
    profile = DisplayProfile.load(PAPER)
    rig = Rig.jittered(profile, 48, 2, 7)
    place = (slot_from_eye(rig.eye_x_mm, profile) + 0.5) * 96  # in halves of a view
    np.testing.assert_array_equal(np.floor(place), np.arange(96))
    assert np.ptp(place - np.floor(place)) > 0.8
    np.testing.assert_array_equal(rig.eye_x_mm, Rig.jittered(profile, 48, 2, 7).eye_x_mm)
    assert not np.array_equal(rig.eye_x_mm, Rig.jittered(profile, 48, 2, 8).eye_x_mm)
    with pytest.raises(UsageError, match="views are 1000 of 16 eyes"):
        Rig.jittered(profile, 1000, 16, 0)


OPTIONS: dict[str, dict[str, Any]] = {
    "spatial samples": {"supersample": (2, 1), "views": 6},
    "filtered spatial samples": {"supersample": (2, 1), "views": 6, "aa": "both"},
    "filter": {"views": 6, "aa": "spatial"},
    "filtered codes": {"views": 6, "aa": "both", "aa_light": "encoded"},
    "continuous": {"views": "continuous"},
    "gold": {"preset": "gold", "views": 5},
}


@pytest.mark.parametrize("kind", OPTIONS)
def test_bands_and_paths_change_nothing(
    renderer: Renderer, scene: Scene, small: DisplayProfile, kind: str
) -> None:
    options = OPTIONS[kind]
    whole = renderer.render(scene, small, **options)
    plan = plan_panel(small, RenderOptions(**options))
    rows = 2 * plan.halo + 3 * plan.times
    renderer.stage(scene, small, **options).close()  # so that the next call makes other bands
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(view_target, "BAND_BYTES", 4 * rows * plan.rig.views * plan.rendered.columns)
        parts = []
        banded = renderer.render(scene, small, progress=parts.append, **options)
    assert len(parts) > 3
    assert parts[-1] == 1.0
    np.testing.assert_array_equal(banded.pixels, whole.pixels)
    without = renderer.render(scene, small, linear=False, **options)
    np.testing.assert_array_equal(without.pixels, whole.pixels)
    assert without.linear is None
    assert whole.linear is not None
    # `look` takes the rows of a display's views where there are more views than that.
    more = kind in ("continuous", "gold")
    assert whole.metadata["lfd:views"] == str(plan.views)
    assert whole.metadata["lfd:eye-views"] == str(small.views if more else options["views"])
    plain = renderer.render(scene, small, views=6)
    assert np.abs(whole.pixels.astype(int) - plain.pixels).mean() > 1


def test_gold_is_for_panel_images(renderer: Renderer, scene: Scene, small: DisplayProfile) -> None:
    with pytest.raises(UsageError, match="preset 'gold': is for panel images"):
        renderer.views(scene, small, preset="gold")


def test_continuous_views_are_each_subpixel_s_own(
    renderer: Renderer, scene: Scene, small: DisplayProfile
) -> None:
    """Against views so many that a subpixel's angle is met 8 times as closely."""
    profile = small.model_copy(update={"viewing": small.viewing.model_copy(update={"views": 8})})

    def render(views: Any) -> np.ndarray:
        size = {"view_size": (80, 60)}
        return renderer.render(scene, profile, views=views, **size).pixels.astype(float)

    true = render(512)
    error = {views: np.sqrt(np.mean((render(views) - true) ** 2)) for views in (8, "continuous")}
    assert error["continuous"] < 0.5 * error[8]
    assert plan_panel(profile, RenderOptions(views="continuous")).views == 64


def test_gold_is_the_papers_standard(small: DisplayProfile) -> None:
    choice = RenderOptions(preset="gold")
    plan = plan_panel(small, choice)
    assert plan.views == 96
    assert (plan.grid.columns, plan.grid.rows) == small.resolution_px
    assert choice.lod_rule == "anisotropic"
    assert (plan.rule.aa, plan.rule.samples) == ("spatial", 32)
    assert plan.rule.pixel[0] == pytest.approx(320 / 40.3)


def test_filters_by_codes_and_by_light_differ_only_in_the_pixels_they_mix(
    renderer: Renderer, scene: Scene, small: DisplayProfile
) -> None:
    by_light = renderer.render(scene, small, views=6, aa="spatial")
    by_codes = renderer.render(scene, small, views=6, aa="spatial", aa_light="encoded")
    assert not np.array_equal(by_light.pixels, by_codes.pixels)
    np.testing.assert_array_equal(by_light.linear, by_codes.linear)
    grid = ViewGrid.lens(small, ViewGrid.default_rows(small, 6))
    flat = np.full((6, grid.rows, grid.columns, 3), 0.25)
    assert (woven(flat, small, grid) == 0.25).all()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"supersample": (0, 1)}, "supersample"),
        ({"supersample": (2, 17)}, "supersample"),
        ({"supersample": 2}, "supersample"),
        ({"views": "continuous", "supersample": (1, 2)}, "continuous"),
        ({"views": "many"}, "views: 'many'"),
        ({"aa": "all"}, "aa 'all'"),
        ({"aa": "both", "weave": "linear"}, "drop weave"),
        ({"lookup": "pixel"}, "lookup 'pixel'"),
        ({"aa_light": "dark"}, "aa light 'dark'"),
    ],
)
def test_bad_choices_are_named(options: dict[str, Any], message: str) -> None:
    with pytest.raises(UsageError, match=message):
        RenderOptions(**options)

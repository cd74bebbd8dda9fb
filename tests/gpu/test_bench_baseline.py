"""Single views by LFDPR are as near the supersampled standard as those by MVR, small."""

import dataclasses

import numpy as np
import pytest
from numpy.typing import NDArray

from lfd_render.bench import baseline
from lfd_render.bench.baseline import DISPLAY, Study, measure, table
from lfd_render.bench.gold import alone, gold_standard, likeness, object_box
from lfd_render.bench.lod import corridor
from lfd_render.display import Camera, DisplayProfile, Rig
from lfd_render.errors import PictureError
from lfd_render.gpu.device import Device
from lfd_render.renderer import Renderer
from lfd_render.scene import Scene

pytestmark = pytest.mark.needs("gl")

SMALL = Study(views=7, view_size=(120, 90), compared=2, samples=4)
MOST = 1.01  # RMSE over MVR's
# What LFDPR is asked for beyond the defaults.
VARIANTS: dict[str, dict[str, object]] = {"default": {}}


@pytest.fixture(scope="module")
def display() -> DisplayProfile:
    return DisplayProfile.load(DISPLAY)


def scene_and_camera(name: str, display: DisplayProfile) -> tuple[Scene, Camera | None]:
    if name == "corridor":
        window = Camera((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), display.size_mm[1])
        return corridor(*display.size_mm), window
    return Scene.load(f"builtin:{name}?triangles=8000"), None


@pytest.mark.shows("RMSE against the standard within 1 % of MVR's, single view at its own position")
@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize(
    ("name", "lod"), [("gallery", "anisotropic"), ("spheres", "area"), ("corridor", "long-axis")]
)
def test_views_are_as_good_as_rasterised_ones(
    device: Device, display: DisplayProfile, name: str, lod: str, variant: str
) -> None:
    scene, camera = scene_and_camera(name, display)
    with Renderer(device) as renderer:
        study = dataclasses.replace(SMALL, lod=lod)
        found = measure(renderer, scene, display, study, camera=camera, **VARIANTS[variant])
    assert found.rmse <= MOST * found.mvr_rmse
    assert found.ssim >= found.mvr_ssim - 1e-3
    assert 1.0 < found.rmse < 60.0  # and neither is the standard itself
    assert len(table([found]).splitlines()) == 3


@pytest.mark.parametrize("fault", ["eyes half an interval aside", "another rule"])
def test_worse_views_are_caught(
    device: Device, display: DisplayProfile, monkeypatch: pytest.MonkeyPatch, fault: str
) -> None:
    scene, camera = scene_and_camera("corridor", display)
    options: dict[str, object] = {}
    if fault == "another rule":
        options = {"lod": "none"}
    else:
        # MVR and the standard from places between those of the views.
        monkeypatch.setattr(baseline, "alone", _aside)
    with Renderer(device) as renderer:
        study = dataclasses.replace(SMALL, lod="area")
        found = measure(renderer, scene, display, study, camera=camera, **options)
    assert found.rmse > 1.1 * found.mvr_rmse


def _aside(rig: Rig, view: int) -> Rig:
    half = 0.5 * np.diff(rig.eye_x_mm).mean()
    return alone(dataclasses.replace(rig, eye_x_mm=rig.eye_x_mm + half), view)


# ---- the standard -----------------------------------------------------------------------------


def test_the_standard_is_the_mean_of_its_samples(device: Device, display: DisplayProfile) -> None:
    """Against one picture a sample, each from a grid moved by a part of a pixel, taken together."""
    scene = Scene.load("builtin:spheres?triangles=2000")
    with Renderer(device) as renderer:
        eye = alone(display.rig(3), 0)
        one, four = (
            gold_standard(
                renderer, scene, display, None, eye=eye, view_size=(60, 45), samples=samples
            )
            for samples in (1, 4)
        )
        (plain,) = renderer.views(
            scene, display, rig=eye, view_size=(60, 45), technique="mvr", lod="anisotropic"
        )
    np.testing.assert_array_equal(one, plain)
    rmse, _ = likeness(four, plain)
    assert 1.0 < rmse < 15.0


def picture(rows: slice, columns: slice) -> NDArray[np.uint8]:
    found = np.zeros((40, 50, 3), np.uint8)
    found[rows, columns] = 200
    return found


@pytest.mark.parametrize(
    ("seen", "box"),
    [
        ((slice(5, 30), slice(10, 45)), (slice(5, 30), slice(10, 45))),
        ((slice(20, 21), slice(0, 3)), (slice(15, 26), slice(0, 11))),  # as large as SSIM's window
        ((slice(39, 40), slice(48, 50)), (slice(29, 40), slice(39, 50))),
    ],
)
def test_the_box_is_the_objects(seen: tuple[slice, slice], box: tuple[slice, slice]) -> None:
    assert object_box(picture(*seen)) == box


def test_a_black_standard_is_refused() -> None:
    with pytest.raises(PictureError, match="all of it is black"):
        object_box(picture(slice(0, 0), slice(0, 0)))

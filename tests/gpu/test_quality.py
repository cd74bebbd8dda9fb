"""Single views by LFDPR are as near the supersampled standard as those by MVR, small; and what the
rules for levels of detail are worth."""

import dataclasses
import statistics
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from lfd_render.bench.gold import alone, chosen_views, gold_standard, likeness, object_box
from lfd_render.display import Camera, DisplayProfile, Rig
from lfd_render.errors import PictureError
from lfd_render.gpu.device import Device
from lfd_render.gpu.layout import LOD_RULES
from lfd_render.renderer import Renderer
from lfd_render.scene import Scene

from .corridor import corridor, in_front_of

pytestmark = pytest.mark.needs("gl")

Pixels = NDArray[np.uint8]
VIEWS, SIZE, SAMPLES = 7, (120, 90), 4
MOST = 1.01  # RMSE over MVR's


@pytest.fixture(scope="module")
def display() -> DisplayProfile:
    return DisplayProfile.load("gavane-2024-tilted-4k")


def scene_and_camera(name: str, display: DisplayProfile) -> tuple[Scene, Camera | None]:
    if name == "corridor":
        return corridor(*display.size_mm), in_front_of(display)
    return Scene.load(f"builtin:{name}?triangles=8000"), None


@dataclasses.dataclass
class Views:
    """The extreme views of a scene by points, and by rasterisation and the standard from `rig`."""

    device: Device
    display: DisplayProfile
    scene: Scene
    camera: Camera | None
    rig: Rig

    def points(self, **options: Any) -> list[Pixels]:
        rig = self.display.rig(VIEWS)
        with Renderer(self.device) as renderer:
            views = renderer.views(
                self.scene, self.display, self.camera, rig=rig, view_size=SIZE, shade="ray",
                **options,
            )  # fmt: skip
        return [views[view] for view in chosen_views(VIEWS, 2)]

    def rasterised(self, lod: str) -> list[Pixels]:
        with Renderer(self.device) as renderer:
            return [
                renderer.views(
                    self.scene, self.display, self.camera, rig=alone(self.rig, view),
                    view_size=SIZE, technique="mvr", lod=lod,
                )[0]
                for view in chosen_views(VIEWS, 2)
            ]  # fmt: skip

    def standard(self) -> list[Pixels]:
        with Renderer(self.device) as renderer:
            return [
                gold_standard(
                    renderer, self.scene, self.display, self.camera, eye=alone(self.rig, view),
                    view_size=SIZE, samples=SAMPLES,
                )
                for view in chosen_views(VIEWS, 2)
            ]  # fmt: skip


def errors(pictures: Sequence[Pixels], standard: Sequence[Pixels]) -> tuple[float, float]:
    """Mean RMSE and SSIM."""
    found = [likeness(a, b) for a, b in zip(pictures, standard, strict=True)]
    return statistics.fmean(f[0] for f in found), statistics.fmean(f[1] for f in found)


@pytest.mark.shows("RMSE against the standard within 1 % of MVR's, single view at its own position")
@pytest.mark.parametrize(
    ("name", "lod"), [("gallery", "anisotropic"), ("spheres", "area"), ("corridor", "long-axis")]
)
def test_views_are_as_good_as_rasterised_ones(
    device: Device, display: DisplayProfile, name: str, lod: str
) -> None:
    views = Views(device, display, *scene_and_camera(name, display), display.rig(VIEWS))
    standard = views.standard()
    rmse, ssim = errors(views.points(lod=lod), standard)
    mvr_rmse, mvr_ssim = errors(views.rasterised(lod), standard)
    assert rmse <= MOST * mvr_rmse
    assert ssim >= mvr_ssim - 1e-3
    assert 1.0 < rmse < 60.0  # and neither is the standard itself


def test_worse_views_are_caught(device: Device, display: DisplayProfile) -> None:
    rig = display.rig(VIEWS)
    half = 0.5 * np.diff(rig.eye_x_mm).mean()
    # MVR and the standard from places between those of the views.
    aside = dataclasses.replace(rig, eye_x_mm=rig.eye_x_mm + half)
    for eyes, lod in ((aside, "area"), (rig, "none")):
        views = Views(device, display, *scene_and_camera("corridor", display), eyes)
        standard = views.standard()
        worse, _ = errors(views.points(lod=lod), standard)
        assert worse > 1.1 * errors(views.rasterised("area"), standard)[0]


def test_each_better_rule_lowers_the_error(device: Device, display: DisplayProfile) -> None:
    views = Views(device, display, *scene_and_camera("corridor", display), display.rig(VIEWS))
    standard = views.standard()
    found = {rule: errors(views.points(lod=rule), standard) for rule in LOD_RULES}
    assert found["anisotropic"][0] < 0.5 * found["multiview"][0] < 0.5 * found["none"][0]
    assert found["anisotropic"][1] > found["multiview"][1] > found["none"][1]


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

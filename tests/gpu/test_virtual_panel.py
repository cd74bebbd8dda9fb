"""The virtual panel against ordinary cameras: what it shows is what stood there."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from lfd_render.display import DisplayProfile, Rig
from lfd_render.panel.look import look_from
from lfd_render.quality import rmse, ssim_luma
from lfd_render.renderer import Renderer
from lfd_render.scene import Scene

pytestmark = pytest.mark.needs("gl")

Pixels = NDArray[np.uint8]
SIZE = (640, 360)


@pytest.fixture(scope="module")
def display() -> DisplayProfile:
    return DisplayProfile.load("gavane-2024-tilted-4k")


@pytest.fixture(scope="module")
def scene() -> Scene:
    return Scene.load("builtin:gallery?triangles=20000")


@pytest.fixture(scope="module")
def eia(renderer: Renderer, scene: Scene, display: DisplayProfile) -> Pixels:
    return renderer.render(scene, display, linear=False).pixels


@pytest.mark.shows("look against an ordinary camera at 50 random eyes inside the cone")
def test_looks_are_what_cameras_see(
    renderer: Renderer,
    scene: Scene,
    display: DisplayProfile,
    eia: Pixels,
    rng: np.random.Generator,
    scaled: Callable[[int, int], int],
    measured: Callable[[str, str], None],
) -> None:
    def camera(angle_rad: float, z_mm: float) -> Pixels:
        eye = np.array([z_mm * math.tan(angle_rad)])
        rig = Rig(eye, z_mm, display.size_mm, 0.05 * z_mm)
        return renderer.views(scene, display, rig=rig, view_size=SIZE, technique="mvr")[0]

    half = display.cone_rad / 2
    scores = []
    for _ in range(scaled(50, 3)):
        # Nearer eyes see wider off the panel's ends; all of it is inside the cone up to here.
        z = display.distance_mm * rng.uniform(0.92, 1.1)
        angle = rng.uniform(-0.7, 0.7) * half
        seen = look_from(eia, display, (z * math.tan(angle), 0.0, z))
        true = camera(angle, z)
        likeness, error = ssim_luma(seen, true), rmse(seen, true)
        # Measured 0.78 to 0.88 and 10 to 17: the display has no vertical parallax, so that what is
        # off the panel is as high as from the viewing distance, and a finite number of views.
        assert likeness > 0.74, (angle, z)
        assert error < 21, (angle, z)
        # Controls: other eyes, and the picture mirrored.
        wrong = [camera(angle + math.radians(off), z) for off in (-3, 3)] + [true[:, ::-1]]
        others = [ssim_luma(seen, np.ascontiguousarray(picture)) for picture in wrong]
        assert max(others) < min(0.68, likeness - 0.15), (angle, z, others)
        scores.append(likeness)
    measured("look against cameras", f"SSIM {min(scores):.3f} to {max(scores):.3f}")


def test_outside_the_cone_the_views_repeat(
    renderer: Renderer, scene: Scene, display: DisplayProfile, eia: Pixels
) -> None:
    """An eye one cone further right sees what the eye in the middle sees, moved by a lens."""
    slot = 0.1
    inner = 2 * math.tan(math.asin(math.sin(display.cone_rad / 2) / display.index))

    def seen(slot: float) -> Pixels:
        angle = math.asin(display.index * math.sin(math.atan(slot * inner)))
        x = display.distance_mm * math.tan(angle)
        return look_from(eia, display, (x, 0.0, display.distance_mm))

    inside, outside = seen(slot), seen(slot + 1)
    lens = round(inside.shape[1] / display.lens_count)
    moved = {by: ssim_luma(inside[:, 8:-8], np.roll(outside, by, 1)[:, 8:-8]) for by in (-1, 0, 1)}
    assert lens == 1
    assert max(moved.values()) > 0.9
    assert ssim_luma(inside, seen(slot + 0.5)) < 0.7  # and half a cone further it does not

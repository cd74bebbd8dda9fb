"""The whole way, scene to encoded panel image, against the reference on a small display."""

import dataclasses
import json

import numpy as np
import pytest
from numpy.typing import NDArray

from lfd_render.display import Camera, DisplayProfile, ViewGrid
from lfd_render.gpu.device import Device
from lfd_render.reference import render_eia
from lfd_render.renderer import Renderer
from lfd_render.scene import Scene

from .helpers import PAPER, millimetre_camera, random_scene

pytestmark = pytest.mark.needs("gl")


def small_display() -> DisplayProfile:
    """The paper's display, of a fifteenth of its pixels and lenses each way."""
    data = json.loads(DisplayProfile.load(PAPER).to_json())
    data["panel"]["resolution_px"] = [256, 144]
    data["lens"] = {"lens_count": 32.1, "drift": data["lens"]["drift"], "center": 0.2}
    data["viewing"]["views"] = 8
    return DisplayProfile.from_json(json.dumps(data))


def likeness(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> tuple[float, int]:
    """Share of subpixels more than 3 levels apart, and their largest difference but for those."""
    off = np.abs(a.astype(int) - b.astype(int))
    return float((off > 3).mean()), int(np.max(off[off <= 3]))


@pytest.mark.parametrize(("upright", "lod"), [(False, "anisotropic"), (True, "multiview")])
def test_panel_images_are_alike(
    device: Device, rng: np.random.Generator, upright: bool, lod: str
) -> None:
    display = small_display()
    scene = random_scene(rng, display, 30)
    camera = millimetre_camera(display.size_mm, depth_scale=0.9).turned(0.1)
    size = (40, 30) if upright else None
    grid = ViewGrid.upright(display, *size) if size else None
    options = {"background": (0.1, 0.2, 0.3), "exposure": 0.8, "lod": lod}
    with Renderer(device) as renderer:
        found = renderer.render(
            scene, display, camera, view_size=size, shade="ray", **options
        ).pixels
    expected = render_eia(scene, display, camera, grid=grid, **options)
    assert found.shape == (144, 256, 3)
    far_off, _ = likeness(found, expected)
    # A pixel whose centre lies on an edge may go either way, and shows in several subpixels.
    assert far_off < 2e-3
    assert (found == expected).mean() > 0.9  # the rest is a level away, by textures' 8 bits
    assert found.std() > 20

    for fault in wrong_ways(scene, display, camera):
        wrong = render_eia(*fault, grid=grid, **options)
        assert likeness(found, wrong)[0] > 0.02


def wrong_ways(
    scene: Scene, display: DisplayProfile, camera: Camera
) -> list[tuple[Scene, DisplayProfile, Camera]]:
    """Planted faults: a depth turned round, a yaw the other way, a lens half a slot aside."""
    data = json.loads(display.to_json())
    data["lens"]["center"] += 0.5
    shifted = DisplayProfile.from_json(json.dumps(data))
    return [
        (scene, display, dataclasses.replace(camera, yaw_rad=-camera.yaw_rad)),
        (scene, display, camera.with_depth_scale(0.5)),
        (scene, shifted, camera),
    ]

"""Arrays of cameras: lines of eyes above one another, each by the shear in y."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from lfd_render import DisplayProfile, Renderer, Scene
from lfd_render.display import Rig, eye_heights_mm
from lfd_render.errors import ResourceError, UsageError
from lfd_render.renderer import camera_for

from .helpers import PAPER, few_lenses

pytestmark = pytest.mark.needs("gl")

SIDE = 128


def square_display() -> DisplayProfile:
    data = json.loads(few_lenses(PAPER, 40.0, (SIDE, SIDE)).to_json())
    data["panel"]["size_mm"] = [200.0, 200.0]
    return DisplayProfile.from_json(json.dumps(data))


DISPLAY = square_display()
SQUARE: dict[str, Any] = {"view_size": (SIDE, SIDE), "seed": 3}


@pytest.fixture(scope="module")
def scene() -> Scene:
    return Scene.load("builtin:gallery?triangles=20000&textures=256")


def quarter_turned(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """What a camera with `up` to the right saw, as one with `up` up sees it."""
    return picture[::-1].swapaxes(0, 1)


@pytest.mark.parametrize("technique", ["lfdpr", "exact", "mvr"])
@pytest.mark.shows("an eye above the panel's centre sees what one beside it does of a rolled world")
def test_up_is_as_sideways(renderer: Renderer, scene: Scene, technique: str) -> None:
    """Rolling the camera by a quarter turn makes heights places and places heights, and leaves the
    world's lights, mirrors and textures as they are. A wrong shear moves edges, a right one that
    light does not follow moves what shines. Nothing differs but what rounding does, by one level
    in a few of the pixels; an edge may fall across a pixel's centre."""
    upright = camera_for(scene, DISPLAY)
    toward, up = np.array(upright.eye_direction), np.array(upright.up)
    right = np.cross(up, toward)
    rolled = replace(upright, up=tuple(right / np.linalg.norm(right)))
    place_mm, height_mm = 0.17 * DISPLAY.distance_mm, 0.29 * DISPLAY.distance_mm

    def seen(camera: Any, x_mm: float, y_mm: float) -> NDArray[np.uint8]:
        rig = Rig.single(DISPLAY, np.arctan(x_mm / DISPLAY.distance_mm))
        ((picture,),) = renderer.views(
            scene, DISPLAY, camera, rig=rig, heights_mm=[y_mm], technique=technique, **SQUARE
        )
        return picture

    direct = seen(upright, place_mm, height_mm).astype(int)
    turned = quarter_turned(seen(rolled, -height_mm, place_mm)).astype(int)
    apart = np.abs(direct - turned).max(axis=-1)
    assert (apart > 1).mean() < 1e-3
    assert apart.mean() < 0.01
    other = quarter_turned(seen(rolled, height_mm, place_mm)).astype(int)
    assert (np.abs(direct - other).max(axis=-1) > 8).mean() > 0.3  # control: an eye below


@pytest.mark.parametrize("shade", ["ray", "shared"])
def test_a_line_at_the_centre_is_the_displays_own(
    renderer: Renderer, scene: Scene, shade: str
) -> None:
    options: dict[str, Any] = SQUARE | {"views": 3, "shade": shade}
    array = renderer.views(scene, DISPLAY, heights_mm=[40.0, 0.0, -40.0], **options)
    assert array.shape == (3, 3, SIDE, SIDE, 3)
    np.testing.assert_array_equal(array[1], renderer.views(scene, DISPLAY, **options))
    for line in (0, 2):
        assert (array[line] != array[1]).mean() > 0.2


def test_supersampled_lines(renderer: Renderer, scene: Scene) -> None:
    fine: dict[str, Any] = SQUARE | {"supersample": (2, 2)}
    array = renderer.views(scene, DISPLAY, views=2, heights_mm=[0.0, 30.0], **fine)
    np.testing.assert_array_equal(array[0], renderer.views(scene, DISPLAY, views=2, **fine))


def test_what_is_no_array_is_refused(renderer: Renderer, scene: Scene) -> None:
    with pytest.raises(UsageError, match="height is nan; it should be finite"):
        renderer.views(scene, DISPLAY, views=2, heights_mm=[0.0, float("nan")], **SQUARE)
    for nothing in (3.0, [], "ab", [None]):
        with pytest.raises(UsageError, match="one for each line of eyes"):
            renderer.views(scene, DISPLAY, views=2, heights_mm=nothing, **SQUARE)
    with pytest.raises(ResourceError, match="more than 4294967296; use fewer"):
        renderer.views(scene, DISPLAY, views=1024, heights_mm=[0.0] * 300, **SQUARE)
    heights = eye_heights_mm(DISPLAY, 3, 0.5)
    assert heights[0] > 0 == heights[1] > heights[2] == -heights[0]

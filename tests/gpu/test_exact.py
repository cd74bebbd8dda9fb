"""The exact technique: slice tracks say what view pixels show, each is shaded by its ray."""

from typing import Any

import numpy as np
import pytest

from lfd_render import DisplayProfile, Renderer, Scene
from lfd_render.errors import UsageError
from lfd_render.renderer.options import RenderOptions

from .helpers import PAPER, few_lenses

pytestmark = pytest.mark.needs("gl")


@pytest.fixture(scope="module")
def scene() -> Scene:
    return Scene.load("builtin:gallery?triangles=20000&textures=256")


def test_it_is_lfdpr_by_rays_whatever_points_would_be(renderer: Renderer, scene: Scene) -> None:
    display = few_lenses(PAPER, 53.3, (320, 180))
    exact = renderer.render(scene, display, views=12, technique="exact")
    for limit in (False, True):
        rays = renderer.render(scene, display, views=12, shade="ray", texture_limit=limit)
        np.testing.assert_array_equal(exact.pixels, rays.pixels)
    assert exact.report["technique"] == exact.metadata["lfd:technique"] == "exact"
    assert exact.metadata["lfd:shade"] == exact.report["shade"] == "ray"
    assert "lfd:density" not in exact.metadata  # which points have
    same = renderer.render(scene, display, views=12, technique="exact", shade="auto")
    np.testing.assert_array_equal(same.pixels, exact.pixels)
    assert exact.report["points"] > 0
    shared = renderer.render(scene, display, views=12)
    assert (exact.pixels != shared.pixels).mean() > 0.01  # control: another technique


@pytest.mark.shows("exact and hardware rasterisation see the same outside edges' rounding")
def test_hardware_sees_the_same(renderer: Renderer, scene: Scene) -> None:
    """The same triangle but where hardware snaps corners across a pixel's centre: there the colour
    is that of a neighbour. 0.02 % of the pixels measured, 0.019 % with a million triangles and
    views of 480 × 360."""
    display = DisplayProfile.load(PAPER)
    common: dict[str, Any] = {"views": 12, "view_size": (160, 120)}
    kinds: tuple[dict[str, Any], ...] = (
        {"technique": "exact"},
        {"technique": "mvr", "mvr": "multipass-deferred"},
    )
    exact, deferred = (
        renderer.views(scene, display, **common, **kind).astype(int) for kind in kinds
    )
    apart = np.abs(exact - deferred).max(axis=-1)
    assert (apart > 1).mean() < 2e-3
    assert ((exact == 0).all(-1) != (deferred == 0).all(-1)).mean() < 1e-3
    assert (np.abs(exact[1:] - deferred[:-1]).max(axis=-1) > 1).mean() > 0.1  # control


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"lattice": "paper"}, "lattice 'paper': technique 'exact' has no points; use it with"),
        ({"shade": "shared"}, "shade 'shared': technique 'exact' shades each pixel by its ray"),
        ({"lod": "multiview"}, "exact has no points that views share; use none or area"),
        ({"mvr": "loop-4"}, "technique 'exact' rasterises no views"),
    ],
)
def test_what_asks_for_points_is_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises(UsageError, match=message):
        RenderOptions(technique="exact", **options)


def test_its_presets_are_those_of_rasterisation() -> None:
    assert RenderOptions(technique="exact").lod_rule == "anisotropic"
    assert RenderOptions(technique="exact", preset="paper").lod_rule == "long-axis"
    assert RenderOptions(technique="exact", splat="two-pass").sampling.shade == "ray"

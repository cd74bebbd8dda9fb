"""Weaving, encoding and the whole pipeline of the reference."""

import json

import numpy as np
import pytest

from lfd_render.display import Camera, DisplayProfile, ViewGrid
from lfd_render.reference import encoded, render_eia, render_views, woven
from lfd_render.reference.encode import encoded_float, shouldered, srgb_from_linear
from lfd_render.reference.weave import view_of
from lfd_render.scene import Material

from .scenes import mesh_of, scene_of, square


def display(**lens: float) -> DisplayProfile:
    data = json.loads(DisplayProfile.load("gavane-2024-tilted-4k").to_json())
    data["panel"]["resolution_px"] = [96, 54]
    data["lens"] = {"lens_count": 12.3, "drift": -0.1, "center": 0.3} | lens
    data["viewing"]["views"] = 4
    return DisplayProfile.from_json(json.dumps(data))


# ---- weaving ----------------------------------------------------------------------------------


def test_views_run_against_the_phase() -> None:
    phase = np.array([0.0, 0.01, 0.24, 0.26, 0.5, 0.99, 1.0, -0.01, 7.3])
    np.testing.assert_array_equal(view_of(phase, 4), [3, 3, 3, 2, 2, 0, 3, 0, 2])


@pytest.mark.parametrize("kind", ["lens", "upright"])
def test_subpixels_show_their_view(kind: str) -> None:
    profile = display()
    grid = ViewGrid.lens(profile, 9) if kind == "lens" else ViewGrid.upright(profile, 12, 9)
    views = np.broadcast_to(np.arange(4.0)[:, None, None, None], (4, 9, grid.columns, 3))
    found = woven(views, profile, grid)
    np.testing.assert_array_equal(found, profile.view_index_map(4))
    assert len(np.unique(found)) == 4


def test_lenses_show_their_own_column() -> None:
    profile = display()
    grid = ViewGrid.lens(profile, 9)
    columns = np.broadcast_to(
        np.arange(float(grid.columns))[None, None, :, None], (4, 9, grid.columns, 3)
    )
    found = woven(columns, profile, grid)
    row = (np.arange(54) + 0.5) / 54 * 9
    lens = np.floor(profile.phase_map()) - grid.row_base[row.astype(int)][:, None, None]
    np.testing.assert_array_equal(found, np.clip(lens, 0, grid.columns - 1))


def test_both_grids_show_a_ramp_at_the_lens_centres() -> None:
    """A ramp over the window: what a lens shows is its centre's place, whichever the grid."""
    profile = display(center=0.0)
    upright, lens = ViewGrid.upright(profile, 200, 54), ViewGrid.lens(profile, 54)
    width = profile.size_mm[0]

    def ramp(grid: ViewGrid) -> np.ndarray:
        column = np.arange(grid.columns) + 0.5
        x = (column - grid.row_offset[:, None]) * grid.column_mm
        return np.broadcast_to(
            np.clip(x, -width / 2, width / 2)[None, :, :, None], (4, 54, grid.columns, 3)
        )

    a, b = (woven(ramp(grid), profile, grid) for grid in (upright, lens))
    inside = np.abs(b) < width / 2 - 1.5 * lens.column_mm
    assert inside.mean() > 0.7
    np.testing.assert_allclose(a[inside], b[inside], atol=1e-9)
    wrong = woven(ramp(lens)[:, ::-1], profile, lens)
    assert np.abs(a - wrong)[inside].max() > 1.0


# ---- encoding ---------------------------------------------------------------------------------


def test_known_levels() -> None:
    assert encoded(np.zeros((1, 3))).tolist() == [[0, 0, 0]]
    assert encoded(np.full((1, 3), 0.5)).tolist() == [[188, 188, 188]]
    np.testing.assert_allclose(srgb_from_linear(np.array([0.0, 0.0031308, 0.5, 1.0])),
                               [0.0, 0.04045, 0.735357, 1.0], rtol=1e-4)  # fmt: skip
    assert encoded(np.full((1, 3), 1e6)).tolist() == [[255, 255, 255]]


def test_the_tone_curve_is_true_below_its_shoulder_and_keeps_order_above() -> None:
    dim = np.array([[0.6, 0.2, 0.1]])
    np.testing.assert_array_equal(shouldered(dim), dim)
    curve = shouldered(np.geomspace(1e-4, 1e5, 500))
    assert np.all(np.diff(curve) > 0)
    assert 0.99 < curve[-1] < 1.0
    # The two parts meet, and so do their slopes.
    at = 0.8 + np.array([-2e-6, -1e-6, 1e-6, 2e-6])
    np.testing.assert_allclose(shouldered(at), at, atol=1e-10)


def test_the_tone_curve_keeps_channels_apart() -> None:
    """They belong to different views."""
    bright = shouldered(np.array([[10.0, 0.0, 0.3]]))
    np.testing.assert_array_equal(bright[0, 1:], [0.0, 0.3])


def test_exposure_multiplies_light() -> None:
    light = np.array([[0.1, 0.2, 0.3]])
    np.testing.assert_allclose(encoded_float(light, 2.0), encoded_float(2 * light))


# ---- the whole way ----------------------------------------------------------------------------


def test_a_wall_fills_the_panel() -> None:
    profile = display()
    wall = scene_of(
        mesh_of(square(2000.0, 0.0)), materials=(Material("m", (0.5, 0.5, 0.5, 1.0), unlit=True),)
    )
    camera = Camera((0, 0, 0), (0, 0, 1), (0, 1, 0), profile.size_mm[1])
    assert set(np.unique(render_eia(wall, profile, camera))) == {188}
    away = Camera((0, 0, 0), (0, 0, -1), (0, 1, 0), profile.size_mm[1])
    empty = render_eia(wall, profile, away, background=(0.5, 0.5, 0.0))
    assert empty.shape == (54, 96, 3)
    assert len(np.unique(empty.reshape(-1, 3), axis=0)) == 1


def test_glass_tints_what_lies_behind_it() -> None:
    profile = display()
    rig, grid = profile.rig(2), ViewGrid.upright(profile, 16, 9)
    materials = (
        Material("glass", (1.0, 0.0, 0.0, 0.25), alpha_mode="blend", unlit=True),
        Material("wall", (0.0, 0.8, 0.0, 1.0), unlit=True),
    )
    panes = [mesh_of(square(60.0, z), 0) for z in (50.0, 20.0)]
    scene = scene_of(*panes, mesh_of(square(2e4, -90.0), 1), materials=materials)
    views = render_views(scene, rig, grid, np.eye(4))
    assert views.solid.ids.min() == 0
    # Only the nearer pane counts: a quarter red over three quarters of the wall.
    np.testing.assert_allclose(views.linear[0, 4, 8], [0.25, 0.6, 0.0])
    np.testing.assert_allclose(views.linear[0, 0, 0], [0.0, 0.8, 0.0])

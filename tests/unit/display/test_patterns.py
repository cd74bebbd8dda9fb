"""Test patterns light what they say, on any panel."""

import math
from typing import Any

import numpy as np
import pytest

from lfd_render.display import DisplayProfile, shipped_profiles
from lfd_render.display.patterns import (
    PATTERNS,
    RULER_BANDS,
    Step,
    crosstalk_bars,
    crosstalk_harmonic,
    phase_pattern,
    phase_steps,
    pitch_ruler,
    ruler_width,
    tilt_ruler,
    view_grating,
    view_numbers,
)
from lfd_render.errors import UsageError

BGR = {"layout": "stripe", "order": "bgr"}
CELLS = {
    "layout": "cells",
    "pattern_mode": 3,
    "offsets_px": tuple(
        ((0.1 * k, 0.0), (0.3 + 0.05 * k, 0.1), (0.6, -0.05 * k)) for k in range(4)
    ),
}


def panel(subpixels: dict[str, Any] | None = None, **lens: float) -> DisplayProfile:
    fields: dict[str, Any] = {"resolution_px": (160, 90), "size_mm": (16.0, 9.0)}
    return DisplayProfile.model_validate(
        {
            "name": "small",
            "panel": fields | ({"subpixels": subpixels} if subpixels else {}),
            "lens": {"lens_count": 20.3, "drift": -0.1, "center": 0.2} | lens,
            "viewing": {"views": 24, "cone_deg": 40.0, "distance_mm": 600.0},
        }
    )


@pytest.mark.parametrize("subpixels", [None, BGR, CELLS])
def test_a_grating_lights_exactly_its_view(subpixels: dict[str, Any] | None) -> None:
    profile = panel(subpixels)
    index = profile.view_index_map()
    for view in (0, 7, 23):
        assert np.array_equal(view_grating(profile, view) > 0, index == view)
    wide = view_grating(profile, 0, 3) > 0
    assert np.array_equal(wide, np.isin(index, [23, 0, 1]))  # taken round the cone
    green = view_grating(profile, 7, colours=(1,))
    assert not green[..., [0, 2]].any()
    assert np.array_equal(green[..., 1] > 0, index[..., 1] == 7)


@pytest.mark.parametrize("subpixels", [None, BGR, CELLS])
@pytest.mark.parametrize("step", [Step(1, 1, 0, 4), Step(0, 1, 1, 3), Step(2, 3, 2, 5)])
def test_a_phase_pattern_is_its_formula(step: Step, subpixels: dict[str, Any] | None) -> None:
    profile = panel(subpixels)
    picture = phase_pattern(profile, step)
    phase = profile.phase_map()[..., step.colour]
    light = 0.5 + 0.4 * np.cos(2 * np.pi * (step.harmonic * phase - step.step / step.steps))
    code = 255 * (1.055 * light ** (1 / 2.4) - 0.055)
    # Half a code of rounding, and the whole lenses that the pattern takes off.
    assert np.abs(picture[..., step.colour] - code).max() <= 0.5 + 1e-6
    others = [c for c in range(3) if c != step.colour]
    assert not picture[..., others].any()
    # A wrong step is seen: the comparison would catch a sign or a shift.
    wrong = phase_pattern(profile, Step(step.colour, step.harmonic, 1 - step.step % 2, step.steps))
    assert np.abs(wrong[..., step.colour] - code).max() > 10


def test_steps_of_a_set_have_names_that_say_them() -> None:
    profile = panel()
    steps = phase_steps(profile, 5)
    assert len(steps) == len({s.name for s in steps}) == 2 * 3 * 5
    assert all(Step.named(s.name) == s for s in steps)
    for name in ("white", "green_4of4", "green_0of2", "green_h0_0of4", "teal_0of4", "green_0of99"):
        assert Step.named(name) is None
    assert crosstalk_harmonic(profile) == 3
    assert crosstalk_harmonic(panel(lens_count=60.0)) == 1
    assert {s.harmonic for s in phase_steps(panel(lens_count=60.0))} == {1}
    with pytest.raises(UsageError, match="steps: 2 is out of range; use 3 to 32"):
        phase_steps(profile, 2)


def test_each_view_shows_its_own_number() -> None:
    profile = panel()
    picture, index = view_numbers(profile), profile.view_index_map()
    # What one view shows of the panel is the same as if all subpixels showed it.
    shown = {view: picture[index == view].mean() for view in range(24)}
    assert min(shown.values()) > 5
    for one, other in ((0, 11), (7, 17)):
        whole = [np.where(index == v, picture, 0).max(axis=2) for v in (one, other)]
        assert not np.array_equal(*whole)


def test_the_middle_bands_of_rulers_are_the_profile_itself() -> None:
    profile = panel()
    own = view_grating(profile, None, ruler_width(profile))
    height, width = own.shape[:2]
    middle = slice(
        math.ceil(height * 5 / RULER_BANDS) - height // RULER_BANDS, height * 5 // RULER_BANDS
    )
    pitch = pitch_ruler(profile)
    assert np.array_equal(pitch[middle, width // 2 :], own[middle, width // 2 :])
    assert not np.array_equal(pitch[: height // RULER_BANDS, width // 2 :], own[:10, width // 2 :])
    columns = slice(width * 4 // RULER_BANDS + 1, width * 5 // RULER_BANDS)
    tilt = tilt_ruler(profile)
    assert np.array_equal(tilt[height // 2 :, columns], own[height // 2 :, columns])
    assert not np.array_equal(tilt[height // 2 :, -10:], own[height // 2 :, -10:])


def test_crosstalk_bars_are_lit_left_and_dark_right() -> None:
    profile = panel()
    bars = crosstalk_bars(profile)[-8:] > 0  # the widest, 12 of 24 views
    lit = (profile.view_index_map()[-8:].astype(int) - 12 + 6) % 24 < 12
    assert np.array_equal(bars[:, 30:80], lit[:, 30:80])
    assert np.array_equal(bars[:, 80:], ~lit[:, 80:])


@pytest.mark.parametrize("name", shipped_profiles())
def test_patterns_fit_every_panel(name: str) -> None:
    profile = DisplayProfile.load(name)
    scale = 16
    width, height = (size // scale for size in profile.resolution_px)
    small = profile.model_copy(
        update={
            "panel": profile.panel.model_copy(update={"resolution_px": (width, height)}),
            "lens": profile.lens.model_copy(update={"lens_count": profile.lens_count / scale}),
        }
    )
    for draw in PATTERNS.values():
        picture = draw(small)
        assert picture.shape == (height, width, 3)
        assert picture.dtype == np.uint8
        assert picture.any()


def test_views_that_a_display_has_not_are_refused() -> None:
    with pytest.raises(UsageError, match="view: 24 is out of range; 'small' has 0 to 23"):
        view_grating(panel(), 24)
    with pytest.raises(UsageError, match="width: 25 views is out of range; use 1 to 24"):
        view_grating(panel(), 0, 25)

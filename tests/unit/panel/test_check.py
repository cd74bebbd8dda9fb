"""The view error of a wrong profile, where it can be worked out by hand."""

import numpy as np
import pytest

from lfd_render.display import DisplayProfile
from lfd_render.errors import ProfileError
from lfd_render.panel.check import view_errors

PORTRAIT = DisplayProfile.load("looking-glass-portrait-sample-a")
VIEWS = 48


def with_lens(**changes: float) -> DisplayProfile:
    return PORTRAIT.model_copy(update={"lens": PORTRAIT.lens.model_copy(update=changes)})


def test_the_right_profile_has_no_error() -> None:
    errors = view_errors(PORTRAIT, with_lens(), VIEWS)
    assert (errors.mean, errors.rms, errors.largest, errors.beyond_half) == (0, 0, 0, 0)
    assert (errors.picture()[: len(errors.error)] == errors.picture()[0, 0]).all()


@pytest.mark.parametrize("shift", [1.5, -3.25])
def test_a_wrong_centre_is_off_by_the_same_everywhere(shift: float) -> None:
    # φ falls as the centre grows, and z = 1 − frac φ rises: views from farther right are woven.
    errors = view_errors(PORTRAIT, with_lens(center=PORTRAIT.center + shift / VIEWS), VIEWS)
    assert errors.mean == pytest.approx(shift)
    assert (errors.rms, errors.largest) == pytest.approx((abs(shift), abs(shift)))
    assert errors.beyond_half == 1
    assert list(errors.corners.values()) == pytest.approx([shift] * 4)
    assert errors.fringes == (0, 0)


def test_it_is_the_error_of_the_view_maps() -> None:
    other = DisplayProfile.load("looking-glass-portrait-sample-b")
    errors = view_errors(PORTRAIT, other, VIEWS)
    difference = other.view_index_map(VIEWS).astype(int) - PORTRAIT.view_index_map(VIEWS)
    difference = (difference + VIEWS // 2) % VIEWS - VIEWS // 2
    # Whole views are a rounding of places on both sides, which evens out.
    assert errors.mean == pytest.approx(difference.mean(), abs=1e-3)
    assert errors.rms == pytest.approx(np.sqrt(np.square(difference).mean() - 1 / 6), abs=0.01)
    assert errors.largest == pytest.approx(np.abs(difference).max(), abs=1)


def test_a_wrong_lens_count_shows_as_fringes() -> None:
    errors = view_errors(PORTRAIT, with_lens(lens_count=PORTRAIT.lens_count - 0.25), VIEWS)
    across, up = errors.fringes
    assert (across, up) == pytest.approx((0.25, 0.25 * PORTRAIT.drift))
    # Left edge to right edge a quarter of the cone, less the half pixels at both ends.
    step = errors.corners["bottom_right"] - errors.corners["bottom_left"]
    assert step == pytest.approx(0.25 * VIEWS * 1535 / 1536, abs=1e-6)


def test_errors_go_the_shorter_way_round() -> None:
    errors = view_errors(PORTRAIT, with_lens(center=PORTRAIT.center + 0.75), VIEWS)
    assert errors.mean == pytest.approx(-VIEWS / 4)
    whole = view_errors(PORTRAIT, with_lens(center=PORTRAIT.center + 3), VIEWS)
    assert whole.largest == pytest.approx(0, abs=1e-9)


def test_the_picture_tells_sides_and_whole_views() -> None:
    errors = view_errors(PORTRAIT, with_lens(lens_count=PORTRAIT.lens_count - 0.2), VIEWS)
    picture = errors.picture().astype(int)
    panel = picture[: len(errors.error)]
    red_minus_blue = panel[..., 0] - panel[..., 2]
    clear = np.abs(errors.error) > 1
    assert (red_minus_blue[clear] > 0)[errors.error[clear] > 0].all()
    assert (red_minus_blue[clear] < 0)[errors.error[clear] < 0].all()
    # Across the middle row a dark line at every whole view but 0.
    middle = len(panel) // 2
    wholes = np.unique(np.floor(errors.error[middle]))
    dark = panel[middle].max(axis=1) < 130
    starts = np.count_nonzero(dark[1:] & ~dark[:-1])
    assert abs(starts - (len(wholes) - 1)) <= 1
    assert max(picture.shape[:2]) <= 960 + 28


def test_another_panel_cannot_be_compared() -> None:
    other = DisplayProfile.load("gavane-2024-tilted-4k")
    with pytest.raises(ProfileError, match=r"3840 x 2160 pixels, that of .* 1536 x 2048"):
        view_errors(PORTRAIT, other, VIEWS)

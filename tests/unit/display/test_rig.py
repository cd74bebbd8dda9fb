"""Rigs against the shear identity and the spacing rules' published differences."""

import math

import numpy as np
import pytest

from lfd_render.display import (
    DisplayProfile,
    Rig,
    eye_heights_mm,
    seen_from_height,
    slot_from_angle,
)
from lfd_render.display.model import Spacing
from lfd_render.errors import UsageError

VIEWS = 48


def profile(cone_deg: float = 40.0) -> DisplayProfile:
    base = DisplayProfile.load("gavane-2024-tilted-4k")
    viewing = base.viewing.model_copy(update={"cone_deg": cone_deg})
    return base.model_copy(update={"viewing": viewing})


@pytest.mark.parametrize("spacing", ["lens", "angle", "tangent"])
def test_eyes_ascend_mirror_and_end_half_a_view_inside_the_cone(spacing: Spacing) -> None:
    eyes = profile().rig(VIEWS, spacing).eye_x_mm
    assert (np.diff(eyes) > 0).all()
    assert eyes == pytest.approx(-eyes[::-1], abs=1e-12)
    assert eyes[-1] < 600 * math.tan(math.radians(20)) < 2 * eyes[-1] - eyes[-2]


def test_lens_spacing_is_snells_law() -> None:
    # Trace each eye's ray through a lens of index n: the hit under the lens is linear in x.
    eyes = profile().rig(VIEWS).eye_x_mm
    inside = np.arcsin(np.sin(np.arctan(eyes / 600)) / 1.49)
    edge = np.arcsin(np.sin(math.radians(20)) / 1.49)
    slot = np.tan(inside) / np.tan(edge) / 2
    assert slot == pytest.approx((np.arange(VIEWS) + 0.5) / VIEWS - 0.5, abs=1e-14)


@pytest.mark.parametrize(
    ("spacing", "cone_deg", "views_off"),
    [("angle", 54, 0.10), ("tangent", 40, 0.32), ("tangent", 54, 0.62)],
)
def test_other_rules_are_as_far_off_as_published(
    spacing: Spacing, cone_deg: float, views_off: float
) -> None:
    display = profile(cone_deg)
    eyes = display.rig(VIEWS, spacing).eye_x_mm
    seen = np.array([slot_from_angle(math.atan(s / 600), display, "lens") for s in eyes])
    slots = (np.arange(VIEWS) + 0.5) / VIEWS - 0.5
    worst = np.abs(seen - slots).max() * VIEWS
    assert views_off - 0.02 < worst < views_off + 0.005


@pytest.mark.parametrize("spacing", ["lens", "angle", "tangent"])
def test_slot_from_angle_inverts_every_rule(spacing: Spacing) -> None:
    display = profile()
    for i, eye in enumerate(display.rig(VIEWS, spacing).eye_x_mm):
        slot = slot_from_angle(math.atan(eye / 600), display, spacing)
        assert slot == pytest.approx((i + 0.5) / VIEWS - 0.5, abs=1e-13)


def test_edge_of_the_cone_is_the_edge_of_the_lens() -> None:
    assert slot_from_angle(math.radians(20), profile()) == pytest.approx(0.5, abs=1e-14)
    assert slot_from_angle(math.radians(25), profile()) > 0.5


def test_matrices_are_the_shear_identity() -> None:
    rig = profile().rig(VIEWS)
    rng = np.random.default_rng(3)
    p_display = rng.uniform([-200, -100, -300], [200, 100, 300], (50, 3))
    clip = np.einsum("vij,pj->vpi", rig.matrices(), np.c_[p_display, np.ones(50)])
    d = 600 - p_display[:, 2]
    k = 600 / d
    x_window = k * p_display[:, 0] + (1 - k) * rig.eye_x_mm[:, None]
    assert clip[..., 3] == pytest.approx(np.broadcast_to(d, (VIEWS, 50)))
    assert clip[..., 0] / clip[..., 3] == pytest.approx(x_window / (345.4 / 2))
    assert clip[..., 1] / clip[..., 3] == pytest.approx(
        np.broadcast_to(k * p_display[:, 1] / (194.3 / 2), (VIEWS, 50))
    )
    assert clip[..., 2] == pytest.approx(clip[..., 3] - 2 * rig.near_mm)


def test_window_and_near_plane_fill_the_clip_box() -> None:
    rig = profile().rig(5)
    corner = rig.matrices() @ [345.4 / 2, 194.3 / 2, 0, 1]
    assert corner[:, :2] / corner[:, 3:] == pytest.approx(np.ones((5, 2)))
    near = rig.matrices() @ [0, 0, 600 - rig.near_mm, 1]
    assert near[:, 2] / near[:, 3] == pytest.approx(-np.ones(5))
    assert rig.near_mm == 30


def test_single_eye_stands_at_its_angle() -> None:
    rig = Rig.single(profile(), math.radians(-15))
    assert rig.eye_x_mm.tolist() == pytest.approx([-600 * math.tan(math.radians(15))])
    for angle in (math.pi / 2, -2.0, math.nan):
        with pytest.raises(UsageError, match="between -90 and 90"):
            Rig.single(profile(), angle)


def test_heights_stand_at_equal_angles_from_the_top() -> None:
    profile = DisplayProfile.load("gavane-2024-tilted-4k")
    heights = eye_heights_mm(profile, 4, math.radians(40))
    angles = np.degrees(np.arctan(heights / profile.distance_mm))
    np.testing.assert_allclose(angles, [15.0, 5.0, -5.0, -15.0])
    assert eye_heights_mm(profile, 1, 1.0).tolist() == [0.0]
    with pytest.raises(UsageError, match="rows is 0"):
        eye_heights_mm(profile, 0, 1.0)
    with pytest.raises(UsageError, match="vertical cone is 180 degrees"):
        eye_heights_mm(profile, 2, math.pi)


def test_seen_from_a_height_by_the_shear_in_y() -> None:
    """A point's place in the window is where the line from the raised eye to it meets z = 0."""
    distance, height, eye_x = 600.0, 130.0, -70.0
    point = np.array([12.0, -31.0, 45.0])
    eye = np.array([eye_x, height, distance])
    met = eye + (point - eye) * distance / (distance - point[2])
    sheared = (seen_from_height(height, distance) @ [*point, 1.0])[:3]
    level = np.array([eye_x, 0.0, distance])
    np.testing.assert_allclose(
        level + (sheared - level) * distance / (distance - sheared[2]), met, atol=1e-12
    )
    with pytest.raises(UsageError, match="height is inf"):
        seen_from_height(math.inf, distance)

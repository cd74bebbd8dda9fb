"""Cameras: where the window stands, how a scene is framed, which way it turns."""

import itertools
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lfd_render.display import Camera, DisplayProfile, comfortable_depth_mm, shipped_profiles
from lfd_render.errors import SceneError

PAPER = DisplayProfile.load("gavane-2024-tilted-4k")
PANEL_MM = PAPER.size_mm
FRONT: dict[str, Any] = {
    "target": [0.0, 0.0, 0.0],
    "eye_direction": [0.0, 0.0, 1.0],
    "up": [0.0, 1.0, 0.0],
    "window_height": 2.0,
}


def to_display(camera: Camera, *points: tuple[float, float, float]) -> np.ndarray:
    matrix = camera.display_from_world(PANEL_MM)
    assert matrix[3].tolist() == [0, 0, 0, 1]
    return np.array(points) @ matrix[:3, :3].T + matrix[:3, 3]


def test_target_top_and_viewer_map_to_the_window() -> None:
    camera = Camera((1, 2, 3), (2, 0, 0), (0, 5, 1e-3), 4.0)
    half = PANEL_MM[1] / 2
    centre, top, right, toward = to_display(camera, (1, 2, 3), (1, 4, 3), (1, 2, 1), (3, 2, 3))
    assert centre == pytest.approx([0, 0, 0], abs=1e-12)
    assert top == pytest.approx([0, half, 0], abs=0.1)
    assert right == pytest.approx([half, 0, 0], abs=0.1)  # the viewer at +x sees −z to the right
    assert toward == pytest.approx([0, 0, half], abs=1e-9)


def test_camera_is_a_rotation_times_a_scale() -> None:
    camera = Camera((1, 2, 3), (1, -2, 0.5), (0.1, 1, 0.3), 4.0).turned(0.7)
    linear = camera.display_from_world(PANEL_MM)[:3, :3] / (PANEL_MM[1] / 4)
    assert linear @ linear.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(linear) == pytest.approx(1)


def test_pitch_brings_the_upper_side_forward_after_yaw() -> None:
    camera = Camera((0, 0, 0), (0, 0, 1), (0, 1, 0), 2.0, yaw_rad=math.pi / 2)
    turned = camera.turned(0.0, math.pi / 2)
    moved = turned.display_from_world((20.0, 20.0))[:3, :3]
    assert moved @ (0, 1, 0) == pytest.approx([0, 0, 10], abs=1e-12)
    # What yaw has brought forward goes down.
    assert moved @ (1, 0, 0) == pytest.approx([0, -10, 0], abs=1e-12)
    assert Camera.from_json_dict(turned.to_json_dict()) == turned


def test_yaw_brings_the_right_hand_side_forward() -> None:
    camera = Camera.from_json_dict(FRONT).turned(math.radians(30))
    (right,) = to_display(camera, (1, 0, 0))
    half = PANEL_MM[1] / 2
    assert right == pytest.approx([half * math.cos(math.pi / 6), 0, half / 2])


def test_dolly_brings_the_scene_forward_along_the_viewers_axis() -> None:
    camera = Camera((1, 2, 3), (1, -2, 0.5), (0.1, 1, 0.3), 4.0, depth_scale=0.5).turned(0.7, 0.3)
    moved = camera.dollied(0.25).display_from_world((40.0, 20.0))
    shift = moved - camera.display_from_world((40.0, 20.0))
    expected = np.zeros((4, 4))
    expected[2, 3] = 0.25 * 20.0 * 0.5  # heights, panel height, depth scale
    assert np.allclose(shift, expected, atol=1e-12)  # rounding of lengths of some tens


def test_depth_scale_acts_about_the_window_after_the_turn() -> None:
    camera = Camera.from_json_dict(FRONT).turned(math.pi / 2).with_depth_scale(0.5)
    (right,) = to_display(camera, (1, 0, 0))
    assert right == pytest.approx([0, 0, PANEL_MM[1] / 4], abs=1e-12)
    assert camera.with_depth_scale(0.5).depth_scale == 0.25


boxes = st.tuples(st.tuples(*[st.floats(-1e3, 1e3)] * 3), st.tuples(*[st.floats(1e-3, 1e3)] * 3))


@settings(derandomize=True, deadline=None, max_examples=60)
@given(boxes, st.sampled_from(shipped_profiles()))
def test_a_framed_box_fits_every_view_and_touches_the_margin(
    box: tuple[tuple[float, ...], tuple[float, ...]], name: str
) -> None:
    profile = DisplayProfile.load(name)
    low, size = np.array(box[0]), np.array(box[1])
    camera = Camera.frame(low, low + size, profile)
    corners = np.array(list(itertools.product(*zip(low, low + size, strict=True))))
    display_from_world = camera.display_from_world(profile.size_mm)
    p_display = np.c_[corners, np.ones(8)] @ display_from_world.T
    clip = np.einsum("vij,pj->vpi", profile.rig().matrices(), p_display)
    reach = np.abs(clip[..., :2] / clip[..., 3:]).max()
    # Corners lose digits where a small box stands far from the origin.
    assert reach == pytest.approx(0.94, rel=1e-6)
    depth = p_display[:, 2]
    assert depth.max() == pytest.approx(-depth.min(), rel=1e-6)
    limit = min(2 * sum(comfortable_depth_mm(profile)), profile.distance_mm)
    assert depth.max() - depth.min() <= limit * (1 + 1e-9)
    if camera.depth_scale < 1:
        assert depth.max() - depth.min() == pytest.approx(limit, rel=1e-6)


@pytest.mark.parametrize("size", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (0, 1, 1)])
def test_flat_boxes_can_be_framed(size: tuple[float, float, float]) -> None:
    camera = Camera.frame((0, 0, 0), size, PAPER)
    assert np.isfinite(camera.display_from_world(PANEL_MM)).all()
    assert camera.target == (size[0] / 2, size[1] / 2, size[2] / 2)


@pytest.mark.parametrize(
    ("low", "high"),
    [((0, 0, 0), (0, 0, 0)), ((0, 0, 0), (1, math.nan, 1)), ((1, 1, 1), (0, 2, 2))],
)
def test_empty_boxes_are_refused(low: Any, high: Any) -> None:
    with pytest.raises(SceneError, match="scene: its bounds are"):
        Camera.frame(low, high, PAPER)


def test_comfortable_depth_moves_a_point_one_lens_a_view() -> None:
    eyes = PAPER.rig().eye_x_mm
    lens_mm = PANEL_MM[0] / PAPER.lens_count
    behind, front = comfortable_depth_mm(PAPER)
    for z in (-behind, front):
        k = 600 / (600 - z)
        assert abs(1 - k) * np.diff(eyes).max() == pytest.approx(lens_mm, rel=1e-12)
    one_view = PAPER.model_copy(update={"viewing": PAPER.viewing.model_copy(update={"views": 1})})
    assert comfortable_depth_mm(one_view) == (math.inf, 600)


def test_a_scene_camera_gives_the_window_at_its_focus() -> None:
    world_from_camera = np.eye(4)
    world_from_camera[:3, :3] = 2 * np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]])  # at +x, scaled
    world_from_camera[:3, 3] = (5, 1, 0)
    camera = Camera.from_view(world_from_camera, math.radians(60), 4.0)
    assert camera.target == pytest.approx((1, 1, 0))
    assert camera.window_height == pytest.approx(8 * math.tan(math.radians(30)))
    half = PANEL_MM[1] / 2
    (top,) = to_display(camera, (1, 1 + camera.window_height / 2, 0))
    assert top == pytest.approx([0, half, 0], abs=1e-9)
    for yfov, focus in ((math.pi, 1.0), (1.0, 0.0), (1.0, math.inf)):
        with pytest.raises(SceneError, match="camera: "):
            Camera.from_view(world_from_camera, yfov, focus)


def test_camera_files_round_trip(tmp_path: Path) -> None:
    camera = Camera((1, 2, 3), (0, 0, 1), (0, 1, 0), 0.1).turned(0.25).with_depth_scale(0.7)
    path = tmp_path / "camera.json"
    path.write_text(json.dumps(camera.to_json_dict()))
    assert Camera.load(path).yaw_rad == pytest.approx(0.25, rel=1e-15)
    assert Camera.load(path).turned(-0.25).depth_scale == 0.7
    path.write_text(json.dumps(FRONT))
    assert Camera.load(path) == Camera((0, 0, 0), (0, 0, 1), (0, 1, 0), 2.0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"target": [0, 0]}, "target.2 is missing"),
        ({"target": [0, math.nan, 0]}, "target.1 is nan"),
        ({"eye_direction": [0, 0, 0]}, "camera: eye_direction is zero"),
        ({"up": [0, 0, 3]}, r"camera: up \(0.0, 0.0, 3.0\) is zero or along eye_direction"),
        ({"window_height": 0}, "window_height is 0; it should be greater than 0"),
        ({"window_height": "2"}, "window_height is '2'"),
        ({"depth_scale": -1}, "depth_scale is -1"),
        ({"fov": 3}, "fov is not a known field"),
    ],
)
def test_bad_camera_files_are_named(tmp_path: Path, change: dict[str, Any], message: str) -> None:
    path = tmp_path / "camera.json"
    path.write_text(json.dumps(FRONT | change))
    with pytest.raises(SceneError, match=rf"camera\.json: {message}") as error:
        Camera.load(path)
    assert "\n" not in str(error.value)


def test_missing_camera_files_are_named(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"gone\.json: cannot be read"):
        Camera.load(tmp_path / "gone.json")

"""Scene, display and camera as the command line names them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lfd_render.cli.console import warn
from lfd_render.cli.options import parse_exposure
from lfd_render.errors import SceneError, UsageError

if TYPE_CHECKING:
    from lfd_render.display import Camera, DisplayProfile
    from lfd_render.panel.eia import EiaFile
    from lfd_render.scene import Scene, SceneCamera


def load_display(name_or_path: str) -> DisplayProfile:
    """The display's profile; raises ProfileError."""
    from lfd_render.display import DisplayProfile  # noqa: PLC0415 (keeps --help quick)

    profile = DisplayProfile.load(name_or_path)
    for warning in display_warnings(profile):
        warn(warning)
    return profile


def display_warnings(profile: DisplayProfile) -> list[str]:
    """What a person should know of a display."""
    if not profile.template:
        return []
    return [
        f"display '{profile.name}': its figures are a model's or assumed; "
        "a real unit needs its own calibration"
    ]


def load_eia(path: str, profile: DisplayProfile) -> EiaFile:
    """The panel image of a file, with its warnings said; raises PictureError."""
    from lfd_render.panel.eia import read_eia  # noqa: PLC0415 (keeps --help quick)

    file = read_eia(path, profile)
    for warning in file.warnings:
        warn(warning)
    return file


def load_scene(source: str) -> Scene:
    """The scene; raises SceneError or ResourceError."""
    from lfd_render.scene import Scene  # noqa: PLC0415 (keeps --help quick)

    scene = Scene.load(source)
    for warning in scene.warnings:
        warn(f"{source}: {warning}")
    return scene


def load_light(
    scene: Scene,
    *,
    environment: str,
    turn_deg: float,
    intensity: float,
    exposure: str | None,
) -> dict[str, Any]:
    """The renderer's options for light, as the command line names them.

    Raises PictureError for an environment that cannot be read, UsageError for options out of range.
    """
    from lfd_render.scene import Environment  # noqa: PLC0415 (keeps --help quick)
    from lfd_render.scene.exposure import exposure_hint  # noqa: PLC0415

    if not math.isfinite(turn_deg):
        raise UsageError(f"--environment-turn: {turn_deg}; give a finite number of degrees")
    if not 0 <= intensity < math.inf:
        raise UsageError(f"--environment-intensity: {intensity}; give a number from 0")
    factor = parse_exposure(exposure)
    if exposure is None and (hint := exposure_hint(scene)):
        warn(hint)
    chosen: str | Environment = environment
    if environment not in ("studio", "none"):
        chosen = Environment.load(environment)
        for warning in chosen.warnings:
            warn(warning)
    return {
        "environment": chosen,
        "environment_turn_rad": math.radians(turn_deg),
        "environment_intensity": intensity,
        "exposure": factor,
    }


def place_camera(
    scene: Scene,
    profile: DisplayProfile,
    *,
    camera: str | None = None,
    focus_distance: float | None = None,
    yaw_deg: float = 0.0,
    depth_scale: float = 1.0,
) -> Camera:
    """Where the window stands: as asked, else the scene's own window, else framed.

    Raises SceneError for a camera that cannot be read, UsageError for options out of range.
    """
    if not math.isfinite(yaw_deg):
        raise UsageError(f"--yaw: {yaw_deg}; give a finite number of degrees")
    if not 0 < depth_scale < math.inf:
        raise UsageError(f"--depth-scale: {depth_scale}; give a number above 0")
    if focus_distance is not None and not 0 < focus_distance < math.inf:
        raise UsageError(f"--focus-distance: {focus_distance}; give a length above 0")
    chosen = _chosen_camera(scene, profile, camera, focus_distance)
    return chosen.turned(math.radians(yaw_deg)).with_depth_scale(depth_scale)


def _chosen_camera(
    scene: Scene, profile: DisplayProfile, camera: str | None, focus_distance: float | None
) -> Camera:
    from lfd_render.display import Camera  # noqa: PLC0415 (keeps --help quick)
    from lfd_render.renderer import camera_for  # noqa: PLC0415

    named = next((c for c in scene.cameras if c.name == camera), None)
    is_file = camera is not None and Path(camera).is_file()
    if focus_distance is not None and (named is None or is_file):
        raise UsageError("--focus-distance: goes with --camera NAME, a camera of the scene")
    if camera is not None and is_file:
        return Camera.load(camera)
    if named is not None:
        distance = focus_distance or _distance_to_middle(scene, named)
        return Camera.from_view(named.world_from_camera, named.yfov_rad, distance)
    if camera is not None:
        names = ", ".join(f"'{c.name}'" for c in scene.cameras) or "none"
        raise SceneError(
            f"--camera: '{camera}'; no such file, and the scene's cameras are: {names}"
        )
    return camera_for(scene, profile)


def _distance_to_middle(scene: Scene, camera: SceneCamera) -> float:
    """Distance from a camera, along its view, to the middle of the scene's box."""
    low, high = scene.bounds()
    backward = camera.world_from_camera[:3, 2]
    to_middle = (low + high) / 2 - camera.world_from_camera[:3, 3]
    distance = float(-(to_middle @ backward) / math.sqrt(float(backward @ backward)))
    if not distance > 0:
        raise UsageError(
            f"--camera: '{camera.name}'; the scene's middle is behind it, give --focus-distance"
        )
    return distance

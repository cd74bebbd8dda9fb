"""What a person chooses about a picture, in the words that the command line and HTTP share."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Literal

from lfd_render.errors import OptionError, SceneError

if TYPE_CHECKING:
    from lfd_render.display import Camera, DisplayProfile
    from lfd_render.display.model import Spacing
    from lfd_render.scene import Environment, Scene, SceneCamera


@dataclass(frozen=True)
class Choices:
    """Options of a picture, degrees and names as people give them; None: as the preset, the display
    or the scene has it.

    camera: a camera of the scene by its name, or a window. dolly: how far that moves into the
    scene, in its heights. exposure: a factor. The rest is as RenderOptions and the command line's
    help say.
    """

    views: int | Literal["continuous"] | None = None
    view_size: tuple[int, int] | None = None
    technique: str = "lfdpr"
    mvr: str = "multipass"
    preset: str = "default"
    lookup: str = "lens"
    weave: str = "nearest"
    aa: str | None = None
    aa_light: str = "linear"
    supersample: tuple[int, int] = (1, 1)
    splat: str = "auto"
    spacing: Spacing | None = None
    lod: str | None = None
    lattice: str | None = None
    point_source: str | None = None
    density: str | None = None
    texture_limit: bool | None = None
    culling: str | None = None
    stochastic_culling: bool | None = None
    shade: str | None = None
    seed: int = 0
    camera: str | Camera | None = None
    focus_distance: float | None = None
    yaw: float = 0.0
    pitch: float = 0.0
    depth_scale: float = 1.0
    dolly: float = 0.0
    environment: str | Environment = "studio"
    environment_turn: float = 0.0
    environment_intensity: float = 1.0
    exposure: float | None = None

    def __post_init__(self) -> None:
        """Check what RenderOptions does not; raises OptionError."""
        for name in ("yaw", "pitch", "environment_turn"):
            if not math.isfinite(getattr(self, name)):
                raise OptionError(name, f"{getattr(self, name)}; give a finite number of degrees")
        if not math.isfinite(self.dolly):
            raise OptionError("dolly", f"{self.dolly}; give a finite number of window heights")
        if not 0 < self.depth_scale < math.inf:
            raise OptionError("depth_scale", f"{self.depth_scale}; give a number above 0")
        if not 0 <= self.environment_intensity < math.inf:
            raise OptionError(
                "environment_intensity", f"{self.environment_intensity}; give a number from 0"
            )
        distance = self.focus_distance
        if distance is not None and not 0 < distance < math.inf:
            raise OptionError("focus_distance", f"{distance}; give a length above 0")
        if distance is not None and not isinstance(self.camera, str):
            raise OptionError("focus_distance", "goes with camera NAME, a camera of the scene")

    def options(self) -> dict[str, Any]:
        """Keywords of `Renderer.render` and `Renderer.views`, RenderOptions under their names."""
        chosen = {name: getattr(self, name) for name in _OPTIONS}
        return chosen | {
            "environment_turn_rad": math.radians(self.environment_turn),
            "exposure": 1.0 if self.exposure is None else self.exposure,
        }

    def window(self, scene: Scene, profile: DisplayProfile) -> Camera:
        """Where the window stands: as chosen, else the scene's own window, else framed.

        Raises SceneError for a camera that the scene lacks, OptionError for one that looks away.
        """
        chosen = self._window(scene, profile)
        turned = chosen.turned(math.radians(self.yaw), math.radians(self.pitch))
        turned = turned.with_depth_scale(self.depth_scale)
        return turned.dollied(self.dolly) if self.dolly else turned

    def _window(self, scene: Scene, profile: DisplayProfile) -> Camera:
        from lfd_render.display import Camera  # noqa: PLC0415 (keeps --help quick)
        from lfd_render.renderer import camera_for  # noqa: PLC0415

        if self.camera is None:
            return camera_for(scene, profile)
        if isinstance(self.camera, Camera):
            return self.camera
        named = next((c for c in scene.cameras if c.name == self.camera), None)
        if named is None:
            names = ", ".join(f"'{c.name}'" for c in scene.cameras) or "none"
            raise SceneError(f"camera: '{self.camera}'; the scene's cameras are: {names}")
        distance = self.focus_distance or _distance_to_middle(scene, named)
        return Camera.from_view(named.world_from_camera, named.yfov_rad, distance)


_OF_THE_WINDOW = {"camera", "focus_distance", "yaw", "pitch", "depth_scale", "dolly"}
_OPTIONS = [f.name for f in fields(Choices) if f.name not in _OF_THE_WINDOW | {"environment_turn"}]


def _distance_to_middle(scene: Scene, camera: SceneCamera) -> float:
    """Distance from a camera, along its view, to the middle of the scene's box."""
    low, high = scene.bounds()
    backward = camera.world_from_camera[:3, 2]
    to_middle = (low + high) / 2 - camera.world_from_camera[:3, 3]
    distance = float(-(to_middle @ backward) / math.sqrt(float(backward @ backward)))
    if not distance > 0:
        raise OptionError(
            "camera", f"'{camera.name}'; the scene's middle is behind it, give a focus distance"
        )
    return distance

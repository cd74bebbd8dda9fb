"""Where the display's window stands in the world: camera files, framing, and the comfort range."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, ValidationError

from lfd_render.display.strict import StrictModel, one_line, read_json_text
from lfd_render.errors import SceneError

if TYPE_CHECKING:
    from lfd_render.display.profile import DisplayProfile

Float64 = NDArray[np.float64]
Vec3 = tuple[float, float, float]

FRAMED = 0.94  # of the window's width and height: a margin of 6 %
DEPTH_RANGES = 2.0  # deepest framed scene, in comfortable ranges
_TURNS = ("yaw", "pitch")
_LEAST_SIZE = 1e-290  # of a framed scene: what is smaller, or larger than 1/this, overflows in mm


class _CameraFile(StrictModel):
    """JSON of a camera file; the last three are optional."""

    target: Vec3
    eye_direction: Vec3
    up: Vec3
    window_height: Annotated[float, Field(gt=0)]
    depth_scale: Annotated[float, Field(gt=0)] = 1.0
    yaw_deg: float = 0.0
    pitch_deg: float = 0.0


@dataclass(frozen=True)
class Camera:
    """The window in the world: its centre, the direction to the viewer, up, and its height.

    `depth_scale` stretches depth about the window; `yaw_rad` turns the scene about the
    window's up axis, positive with its right-hand side coming forward, and then `pitch_rad` about
    the axis to the window's right, positive with its upper side coming forward. Raises SceneError
    when the numbers make no window.
    """

    target: Vec3
    eye_direction: Vec3
    up: Vec3
    window_height: float
    depth_scale: float = 1.0
    yaw_rad: float = 0.0
    pitch_rad: float = 0.0

    def __post_init__(self) -> None:
        vectors = {"target": self.target, "eye_direction": self.eye_direction, "up": self.up}
        for name, vector in vectors.items():
            if len(vector) != 3 or not all(map(math.isfinite, vector)):
                raise SceneError(f"camera: {name} is {vector}; it should be three finite numbers")
        if not np.linalg.norm(self.eye_direction) > 0:
            raise SceneError("camera: eye_direction is zero; it should point to the viewer")
        if np.linalg.norm(np.cross(_unit(self.up), _unit(self.eye_direction))) < 1e-9:
            raise SceneError(
                f"camera: up {self.up} is zero or along eye_direction {self.eye_direction}; "
                "give another up"
            )
        sizes = {"window_height": self.window_height, "depth_scale": self.depth_scale}
        for name, size in sizes.items():
            if not 0 < size < math.inf:
                raise SceneError(f"camera: {name} is {size}; it should be above 0 and finite")
        for name, angle in (("yaw", self.yaw_rad), ("pitch", self.pitch_rad)):
            if not math.isfinite(angle):
                raise SceneError(f"camera: {name} is {angle}; it should be finite")

    def display_from_world(self, panel_mm: tuple[float, float]) -> Float64:
        """World → display space in mm, [4, 4]: depth scale · pitch · yaw · scale · rotation ·
        shift."""
        toward = _unit(self.eye_direction)
        right = _unit(np.cross(_unit(self.up), toward))
        rotation = np.stack([right, np.cross(toward, right), toward])
        cos, sin = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        yaw = np.array([[cos, 0.0, -sin], [0.0, 1.0, 0.0], [sin, 0.0, cos]])
        cos, sin = math.cos(self.pitch_rad), math.sin(self.pitch_rad)
        pitch = np.array([[1.0, 0.0, 0.0], [0.0, cos, -sin], [0.0, sin, cos]])
        depth = np.diag([1.0, 1.0, self.depth_scale])
        display_from_world = np.eye(4)
        with np.errstate(over="ignore", invalid="ignore"):
            scale = np.float64(panel_mm[1]) / self.window_height
            display_from_world[:3, :3] = depth @ pitch @ yaw @ rotation * scale
            display_from_world[:3, 3] = -display_from_world[:3, :3] @ np.array(self.target)
        if not np.isfinite(display_from_world).all():
            raise SceneError(
                f"camera: window_height {self.window_height} with target {list(self.target)} and "
                f"depth_scale {self.depth_scale}: beyond double precision; scale the scene"
            )
        return display_from_world

    @staticmethod
    def load(path: str | Path) -> Camera:
        """Camera of a JSON file (target, eye_direction, up, window_height); raises SceneError."""
        return Camera._from_text(read_json_text(Path(path), SceneError), str(path))

    @staticmethod
    def _from_text(text: str, source: str) -> Camera:
        try:
            file = _CameraFile.model_validate_json(text)
        except ValidationError as cause:
            raise SceneError(one_line(cause, source)) from cause
        fields = file.model_dump()
        fields |= {f"{turn}_rad": math.radians(fields.pop(f"{turn}_deg")) for turn in _TURNS}
        try:
            return Camera(**fields)
        except SceneError as cause:
            raise SceneError(f"{source}: {cause}") from cause

    @staticmethod
    def from_json_dict(data: dict[str, Any], source: str = "camera") -> Camera:
        """Camera of the plain data of a camera file; raises SceneError."""
        return Camera._from_text(json.dumps(data), source)

    def to_json_dict(self) -> dict[str, Any]:
        """Plain data of a camera file that says the same."""
        data = asdict(self)
        for name in _TURNS:
            data[f"{name}_deg"] = math.degrees(data.pop(f"{name}_rad"))
        return data

    @staticmethod
    def frame(bounds_min: ArrayLike, bounds_max: ArrayLike, profile: DisplayProfile) -> Camera:
        """Camera for a box without one: +y up, the viewer at +z (the glTF front).

        The box fits 94 % of the window in every view, near parts counted in perspective, its
        depth centred on the window. Deeper than twice the comfortable range (and than D, so
        that nothing comes closer than half way to the eyes) it is squeezed to that depth.
        Raises SceneError for a box that is empty, not finite, or beyond 1e±300.
        """
        low, high = np.asarray(bounds_min, np.float64), np.asarray(bounds_max, np.float64)
        with np.errstate(over="ignore", invalid="ignore"):
            size = high - low
        if not ((size >= 0).all() and _LEAST_SIZE < size.max(initial=0.0) < 1.0 / _LEAST_SIZE):
            raise SceneError(
                f"scene: its bounds are {low.tolist()} to {high.tolist()}; they should be finite "
                "and have an extent, neither too small nor too large"
            )
        limit_mm = min(DEPTH_RANGES * sum(comfortable_depth_mm(profile)), profile.distance_mm)
        scale = _largest_fitting_scale(size, limit_mm, profile)
        depth_scale = min(1.0, limit_mm / float(scale * size[2])) if size[2] > 0 else 1.0
        x, y, z = ((low + high) / 2).tolist()
        window_height = profile.size_mm[1] / scale
        return Camera((x, y, z), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), window_height, depth_scale)

    @staticmethod
    def from_view(world_from_camera: Float64, yfov_rad: float, focus_distance: float) -> Camera:
        """Camera that sees at `focus_distance` (world units) what a perspective camera sees.

        `world_from_camera` looks along its −z with +y up, as glTF has it. The perspective of
        other depths follows from the display's viewing distance, not from `yfov_rad`.
        """
        if not 0 < focus_distance < math.inf:
            raise SceneError(f"camera: focus distance is {focus_distance}; it should be above 0")
        if not 0 < yfov_rad < math.pi:
            raise SceneError(f"camera: yfov is {yfov_rad}; it should be between 0 and pi")
        eye, toward, up = (world_from_camera[:3, column] for column in (3, 2, 1))
        if not np.linalg.norm(toward) > 0:
            raise SceneError("camera: its node has no z axis; give its transform a scale above 0")
        target = eye - focus_distance * _unit(toward)
        window_height = 2 * focus_distance * math.tan(yfov_rad / 2)
        return Camera(_vec3(target), _vec3(toward), _vec3(up), window_height)

    def turned(self, yaw_rad: float, pitch_rad: float = 0.0) -> Camera:
        """This camera with the scene turned further, its right-hand side and its upper side coming
        forward."""
        return replace(self, yaw_rad=self.yaw_rad + yaw_rad, pitch_rad=self.pitch_rad + pitch_rad)

    def dollied(self, heights: float) -> Camera:
        """This camera with its window moved so many of its heights into the scene, away from the
        viewer; negative: toward the viewer."""
        into = -np.linalg.inv(self.display_from_world((1.0, 1.0))[:3, :3])[:, 2]
        target = np.array(self.target) + heights * self.window_height * _unit(into)
        return replace(self, target=_vec3(target))

    def with_depth_scale(self, factor: float) -> Camera:
        """This camera with depth about the window multiplied by a factor."""
        return replace(self, depth_scale=self.depth_scale * factor)


def comfortable_depth_mm(profile: DisplayProfile) -> tuple[float, float]:
    """Depth (behind, in front of) the panel up to which neighbouring views still blend.

    There a point moves by one lens from a view to the next: |(1−k)·Δs| = w/P, k = D/(D−Z),
    with Δs the widest gap between neighbouring eyes. Infinite behind where no depth does.
    """
    distance = profile.distance_mm
    if profile.views == 1:
        return math.inf, distance
    gap_mm = float(np.diff(profile.rig().eye_x_mm).max())
    ratio = profile.size_mm[0] / profile.lens_count / gap_mm
    behind = distance * ratio / (1 - ratio) if ratio < 1 else math.inf
    return behind, distance * ratio / (1 + ratio)


def _largest_fitting_scale(size: Float64, limit_mm: float, profile: DisplayProfile) -> float:
    """Largest mm per world unit at which a box of this size fits the framed window in all views."""
    half_window = FRAMED / 2 * np.array(profile.size_mm)
    distance = profile.distance_mm
    reach_mm = np.array([np.abs(profile.rig().eye_x_mm).max(), 0.0])

    def fits(scale: float) -> bool:
        half_depth = min(scale * size[2], limit_mm) / 2
        for z in (half_depth, -half_depth):
            k = distance / (distance - z)
            if np.any(k * scale * size[:2] / 2 + abs(1 - k) * reach_mm > half_window):
                return False
        return True

    sides = [2 * h / s for h, s in zip(half_window, size[:2], strict=True) if s > 0]
    low, high = 0.0, float(min(sides) if sides else max(profile.size_mm) / size[2])
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if fits(middle) else (low, middle)
    return high if low == 0 else low


def _unit(vector: ArrayLike) -> Float64:
    array = np.asarray(vector, np.float64)
    length = float(np.linalg.norm(array))
    return array / length if length > 0 else array


def _vec3(vector: Float64) -> Vec3:
    x, y, z = vector.tolist()
    return x, y, z

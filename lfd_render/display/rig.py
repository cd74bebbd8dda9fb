"""The cameras of a display: where the eye of each view stands, and its projection.

All eyes stand on a line at the viewing distance D and look through one window, the panel
(off-axis frusta, never toed-in). Arrays of cameras are several such lines, one above the other
(`seen_from_height`). A view's place x under its lens, from −½ to ½, and its eye
s_i follow one of three rules:

    lens     s = D·tan(asin(n·sin(atan(2x·tan(asin(sin(cone/2)/n))))))     refraction included
    angle    s = D·tan(cone·x)
    tangent  s = 2·D·tan(cone/2)·x
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, assert_never

import numpy as np
from numpy.typing import NDArray

from lfd_render.display.model import MAX_VIEWS, Spacing
from lfd_render.errors import UsageError

if TYPE_CHECKING:
    from lfd_render.display.profile import DisplayProfile

Float64 = NDArray[np.float64]
NEAR_FRACTION = 0.05  # of the viewing distance


@dataclass(frozen=True, eq=False)
class Rig:
    """Eyes at (eye_x_mm[i], 0, distance_mm), all looking through the same panel window."""

    eye_x_mm: Float64  # [view], ascending: view 0 leftmost
    distance_mm: float
    panel_mm: tuple[float, float]
    near_mm: float  # distance of the near plane from the eyes

    @property
    def views(self) -> int:
        """Number of eyes."""
        return len(self.eye_x_mm)

    def only(self, view: int) -> Rig:
        """The rig of one of its eyes."""
        return replace(self, eye_x_mm=self.eye_x_mm[view : view + 1])

    def matrices(self) -> Float64:
        """`clip_from_display` of each view, [view, 4, 4], far plane at infinity.

        With d = D − Z: x_clip = (2/w)·(D·X − s·Z), y_clip = (2/h)·D·Y, z_clip = d − 2·near,
        w_clip = d, so that the panel's window fills x, y in [−1, 1] at Z = 0 in every view.
        """
        width, height = self.panel_mm
        clip_from_display = np.zeros((self.views, 4, 4))
        clip_from_display[:, 0, 0] = 2 / width * self.distance_mm
        clip_from_display[:, 0, 2] = -2 / width * self.eye_x_mm
        clip_from_display[:, 1, 1] = 2 / height * self.distance_mm
        clip_from_display[:, 2:, 2] = -1
        clip_from_display[:, 2, 3] = self.distance_mm - 2 * self.near_mm
        clip_from_display[:, 3, 3] = self.distance_mm
        return clip_from_display

    @staticmethod
    def of(
        profile: DisplayProfile, views: int | None = None, spacing: Spacing | None = None
    ) -> Rig:
        """Rig of N views whose eyes stand at the centres of the view slots, x = (i+½)/N − ½."""
        count = profile.views if views is None else views
        if not 1 <= count <= MAX_VIEWS:
            raise UsageError(f"views is {count}; it should be from 1 to {MAX_VIEWS}")
        slot = (np.arange(count) + 0.5) / count - 0.5
        return _rig(profile, eye_from_slot(slot, profile, spacing))

    @staticmethod
    def jittered(
        profile: DisplayProfile, views: int, eyes: int, seed: int, spacing: Spacing | None = None
    ) -> Rig:
        """Rig of so many eyes a view, one at a random place in each equal part of the view's slot:
        eye v·eyes + m belongs to view v."""
        if not 1 <= views * eyes <= MAX_VIEWS:
            raise UsageError(
                f"views are {views} of {eyes} eyes; all eyes should be from 1 to {MAX_VIEWS}"
            )
        count = views * eyes
        # numpy keeps the numbers of this generator for all time.
        place = np.random.RandomState(seed & 0xFFFFFFFF).random_sample(count)
        slot = (np.arange(count) + place) / count - 0.5
        return _rig(profile, eye_from_slot(slot, profile, spacing))

    @staticmethod
    def single(profile: DisplayProfile, angle_rad: float) -> Rig:
        """One eye at (D·tan θ, 0, D), θ positive to the viewer's right, |θ| < 90°."""
        check_angle(angle_rad)
        return _rig(profile, np.array([profile.distance_mm * np.tan(angle_rad)]))


def _rig(profile: DisplayProfile, eye_x_mm: Float64) -> Rig:
    near_mm = NEAR_FRACTION * profile.distance_mm
    return Rig(eye_x_mm, profile.distance_mm, profile.size_mm, near_mm)


def eye_heights_mm(profile: DisplayProfile, rows: int, cone_rad: float) -> Float64:
    """Heights of so many lines of eyes above the panel's centre, the highest first: at the centres
    of equal parts of a cone, as eyes of spacing `angle` stand."""
    if rows < 1:
        raise UsageError(f"rows is {rows}; it should be at least 1")
    if not 0 < cone_rad < np.pi:
        raise UsageError(
            f"vertical cone is {np.degrees(cone_rad):g} degrees; it should be above 0 and below 180"
        )
    slot = 0.5 - (np.arange(rows) + 0.5) / rows
    return np.asarray(profile.distance_mm * np.tan(cone_rad * slot))


def seen_from_height(height_mm: float, distance_mm: float) -> Float64:
    """What takes display space to where eyes at height h above the panel's centre see it as eyes
    at height 0 would, [4, 4]: y − (h/D)·z, the shear identity in y. The window, depths, and what
    eyes on one line share stay as they are."""
    if not np.isfinite(height_mm):
        raise UsageError(f"height is {height_mm}; it should be finite")
    shear = np.eye(4)
    shear[1, 2] = -height_mm / distance_mm
    return shear


def check_angle(angle_rad: float) -> None:
    """Raise UsageError for an angle from which the panel cannot be seen."""
    if not abs(angle_rad) < np.pi / 2:
        raise UsageError(
            f"angle is {np.degrees(angle_rad):g} degrees; it should be between -90 and 90"
        )


def eye_from_slot(
    slot: Float64, profile: DisplayProfile, spacing: Spacing | None = None
) -> Float64:
    """Eye position s in mm of each place x under its lens (−½..½), by the module's formulas."""
    half, index, distance = profile.cone_rad / 2, profile.index, profile.distance_mm
    rule = profile.spacing if spacing is None else spacing
    match rule:
        case "lens":
            inner = np.arctan(2 * slot * np.tan(np.arcsin(np.sin(half) / index)))
            return np.asarray(distance * np.tan(np.arcsin(index * np.sin(inner))))
        case "angle":
            return np.asarray(distance * np.tan(2 * half * slot))
        case "tangent":
            return np.asarray(2 * distance * np.tan(half) * slot)
    assert_never(rule)


def slot_from_angle(
    angle_rad: float, profile: DisplayProfile, spacing: Spacing | None = None
) -> float:
    """Place x under its lens that an eye at the angle θ sees: the inverse of `eye_from_slot`.

    Beyond half the cone |x| exceeds ½: the eye sees the neighbouring lens, the views repeat.
    """
    check_angle(angle_rad)
    eye_mm = np.array(profile.distance_mm * np.tan(angle_rad))
    return float(slot_from_eye(eye_mm, profile, spacing))


def slot_from_eye(
    eye_x_mm: Float64, profile: DisplayProfile, spacing: Spacing | None = None
) -> Float64:
    """Place x under its lens that the eye at (s, 0, D) sees, of each s: `eye_from_slot` undone."""
    half, index = profile.cone_rad / 2, profile.index
    rule = profile.spacing if spacing is None else spacing
    angle = np.arctan(np.asarray(eye_x_mm) / profile.distance_mm)
    match rule:
        case "lens":
            inner = np.tan(np.arcsin(np.sin(angle) / index))
            return np.asarray(inner / (2 * np.tan(np.arcsin(np.sin(half) / index))))
        case "angle":
            return np.asarray(angle / (2 * half))
        case "tangent":
            return np.asarray(np.tan(angle) / (2 * np.tan(half)))
    assert_never(rule)

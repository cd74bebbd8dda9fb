"""Displays: calibration profiles, phase and view maps, rigs, view grids and cameras."""

from lfd_render.display.camera import Camera, comfortable_depth_mm
from lfd_render.display.grid import ViewGrid
from lfd_render.display.phase import PhaseTables, view_index
from lfd_render.display.profile import DisplayProfile, shipped_profiles
from lfd_render.display.reconstruction import Reconstruction
from lfd_render.display.rig import (
    Rig,
    eye_from_slot,
    eye_heights_mm,
    seen_from_height,
    slot_from_angle,
    slot_from_eye,
)

__all__ = [
    "Camera",
    "DisplayProfile",
    "PhaseTables",
    "Reconstruction",
    "Rig",
    "ViewGrid",
    "comfortable_depth_mm",
    "eye_from_slot",
    "eye_heights_mm",
    "seen_from_height",
    "shipped_profiles",
    "slot_from_angle",
    "slot_from_eye",
    "view_index",
]

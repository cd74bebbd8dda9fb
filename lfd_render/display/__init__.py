"""Displays: calibration profiles, phase and view maps, rigs, view grids and cameras."""

from .camera import Camera, comfortable_depth_mm
from .grid import ViewGrid
from .phase import PhaseTables, view_index
from .profile import DisplayProfile, shipped_profiles
from .rig import Rig, eye_from_slot, slot_from_angle

__all__ = [
    "Camera",
    "DisplayProfile",
    "PhaseTables",
    "Rig",
    "ViewGrid",
    "comfortable_depth_mm",
    "eye_from_slot",
    "shipped_profiles",
    "slot_from_angle",
    "view_index",
]

"""Calibration of an unknown panel from photographs of test patterns."""

from lfd_render.display.calibration.corners import Corners, find_corners, given_corners
from lfd_render.display.calibration.fit import Fit, fit
from lfd_render.display.calibration.measure import PhotoSet

__all__ = ["Corners", "Fit", "PhotoSet", "find_corners", "fit", "given_corners"]

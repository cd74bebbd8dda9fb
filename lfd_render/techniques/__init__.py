"""Techniques: each a list of passes."""

from .base import Placement, Technique
from .lfdpr import Lfdpr
from .mvr import Mvr

__all__ = ["Lfdpr", "Mvr", "Placement", "Technique"]

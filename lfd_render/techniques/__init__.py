"""Techniques: each a list of passes."""

from lfd_render.techniques.base import Technique
from lfd_render.techniques.lfdpr import Lfdpr
from lfd_render.techniques.mvr import Mvr

__all__ = ["Lfdpr", "Mvr", "Technique"]

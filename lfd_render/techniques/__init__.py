"""Techniques: each a list of passes."""

from lfd_render.techniques.base import Technique
from lfd_render.techniques.lfdpr import Lfdpr
from lfd_render.techniques.mvr import make_mvr

__all__ = ["Lfdpr", "Technique", "make_mvr"]

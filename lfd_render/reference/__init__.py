"""The pipeline in plain numpy: the specification that GPU code is tested against.

Small, slow and readable: float64, straight from the definitions, one pixel's ray at a time in
meaning if not in execution. Nothing here knows of buffers, passes or shaders.
"""

from .encode import encoded
from .pipeline import Views, render_eia, render_views
from .raster import NO_TRIANGLE, Pixels, Visibility, visible
from .transform import Triangles, placed
from .weave import woven

__all__ = [
    "NO_TRIANGLE",
    "Pixels",
    "Triangles",
    "Views",
    "Visibility",
    "encoded",
    "placed",
    "render_eia",
    "render_views",
    "visible",
    "woven",
]

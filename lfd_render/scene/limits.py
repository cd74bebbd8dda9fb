"""How much a scene file may ask for before it is refused."""

from __future__ import annotations

import threading
from dataclasses import dataclass

from lfd_render.errors import ResourceError

MAX_IMAGE_SIDE = 16384
MOST_LIGHTS = 256  # what the smallest uniform block that OpenGL promises holds


@dataclass(frozen=True)
class LoadLimits:
    """Caps on what one scene may take; ResourceError beyond them.

    The defaults suit a person's own files; a service sets smaller ones.
    """

    file_bytes: int = 4 << 30  # bytes of one file or data URI
    image_pixels: int = MAX_IMAGE_SIDE**2  # pixels of one picture
    texels: int = 1 << 30  # pixels of all pictures: 4 GiB decoded
    mesh_bytes: int = 8 << 30  # vertex and index bytes of all meshes
    nodes: int = 1 << 20  # nodes, and instances of meshes
    drawn_triangles: int = 1 << 28  # triangles counted over instances
    lights: int = MOST_LIGHTS  # lights of nodes that are drawn


class Budget:
    """What is left of the limits while one scene loads; safe to draw on from several threads."""

    def __init__(self, limits: LoadLimits) -> None:
        self.limits = limits
        self._left = {"texels": limits.texels, "mesh_bytes": limits.mesh_bytes}
        self._lock = threading.Lock()

    def take(self, kind: str, amount: int) -> None:
        """Use up part of `texels` or `mesh_bytes`; raises ResourceError when it is gone."""
        with self._lock:
            self._left[kind] -= amount
            if self._left[kind] < 0:
                limit = getattr(self.limits, kind)
                raise ResourceError(
                    f"{kind}: {limit - self._left[kind]} and more; the limit is {limit}, "
                    "reduce the scene"
                )

"""Light-field rendering for tilted-lenticular displays: scenes in, panel images out."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from lfd_render.version import __version__

if TYPE_CHECKING:
    from lfd_render.display import Camera, DisplayProfile
    from lfd_render.errors import LfdError
    from lfd_render.panel.eia import Eia
    from lfd_render.panel.look import look
    from lfd_render.panel.quilt import Quilt
    from lfd_render.panel.unweave import unweave
    from lfd_render.renderer import Renderer
    from lfd_render.scene import Environment, Pose, Scene, node_transform

__all__ = [
    "Camera",
    "DisplayProfile",
    "Eia",
    "Environment",
    "LfdError",
    "Pose",
    "Quilt",
    "Renderer",
    "Scene",
    "__version__",
    "look",
    "node_transform",
    "unweave",
]

# Loaded when first used, so that the command line answers --help without numpy or OpenGL.
_HOMES = {
    "Camera": "lfd_render.display",
    "DisplayProfile": "lfd_render.display",
    "Eia": "lfd_render.panel.eia",
    "Environment": "lfd_render.scene",
    "LfdError": "lfd_render.errors",
    "Pose": "lfd_render.scene",
    "Quilt": "lfd_render.panel.quilt",
    "Renderer": "lfd_render.renderer",
    "Scene": "lfd_render.scene",
    "look": "lfd_render.panel.look",
    "node_transform": "lfd_render.scene",
    "unweave": "lfd_render.panel.unweave",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'lfd_render' has no attribute '{name}'")
    return getattr(import_module(_HOMES[name]), name)

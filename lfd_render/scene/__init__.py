"""Scenes: glTF and OBJ files, procedural built-ins, and the frozen data they become."""

from lfd_render.scene.limits import LoadLimits
from lfd_render.scene.model import (
    Image,
    Instance,
    Material,
    Mesh,
    Scene,
    SceneCamera,
    TextureSlot,
    WindowCamera,
)

__all__ = [
    "Image",
    "Instance",
    "LoadLimits",
    "Material",
    "Mesh",
    "Scene",
    "SceneCamera",
    "TextureSlot",
    "WindowCamera",
]

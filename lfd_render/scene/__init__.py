"""Scenes: glTF and OBJ files, procedural built-ins, and the frozen data they become."""

from lfd_render.scene.environment import Environment
from lfd_render.scene.limits import LoadLimits
from lfd_render.scene.model import (
    Image,
    Instance,
    Light,
    Material,
    Mesh,
    Scene,
    SceneCamera,
    TextureSlot,
    WindowCamera,
)

__all__ = [
    "Environment",
    "Image",
    "Instance",
    "Light",
    "LoadLimits",
    "Material",
    "Mesh",
    "Scene",
    "SceneCamera",
    "TextureSlot",
    "WindowCamera",
]

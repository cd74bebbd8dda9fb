"""Scenes: glTF and OBJ files, procedural built-ins, and the frozen data they become."""

from .limits import LoadLimits
from .model import (
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

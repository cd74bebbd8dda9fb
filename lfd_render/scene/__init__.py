"""Scenes: glTF and OBJ files, procedural built-ins, and the frozen data they become."""

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
    "Material",
    "Mesh",
    "Scene",
    "SceneCamera",
    "TextureSlot",
    "WindowCamera",
]

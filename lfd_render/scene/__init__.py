"""Scenes: glTF and OBJ files, procedural built-ins, and the frozen data they become."""

from lfd_render.scene.deform import Influences, Morph, Skin
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
from lfd_render.scene.nodes import NO_PARENT, Nodes, node_transform
from lfd_render.scene.pose import Pose, Posed, Poser

__all__ = [
    "NO_PARENT",
    "Environment",
    "Image",
    "Influences",
    "Instance",
    "Light",
    "LoadLimits",
    "Material",
    "Mesh",
    "Morph",
    "Nodes",
    "Pose",
    "Posed",
    "Poser",
    "Scene",
    "SceneCamera",
    "Skin",
    "TextureSlot",
    "WindowCamera",
    "node_transform",
]

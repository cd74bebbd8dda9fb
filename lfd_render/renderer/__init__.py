"""The renderer: one device, any scene, any display."""

from lfd_render.renderer.options import RenderOptions
from lfd_render.renderer.plan import upright_size
from lfd_render.renderer.renderer import Renderer, camera_for

__all__ = ["RenderOptions", "Renderer", "camera_for", "upright_size"]

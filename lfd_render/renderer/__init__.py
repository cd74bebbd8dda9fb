"""The renderer: one device, any scene, any display."""

from lfd_render.renderer.options import RenderOptions
from lfd_render.renderer.plan import upright_size
from lfd_render.renderer.renderer import Renderer, camera_for
from lfd_render.renderer.stage import Stage

__all__ = ["RenderOptions", "Renderer", "Stage", "camera_for", "upright_size"]

"""Encoding of view images."""

from __future__ import annotations

from lfd_render.gpu import raw as gl
from lfd_render.gpu.device import Device
from lfd_render.gpu.framebuffer import LayerTarget
from lfd_render.gpu.memory import TextureArray
from lfd_render.passes.screen import ScreenPass
from lfd_render.passes.view_target import ViewImages


class EncodeViews:
    """View images in linear light → the same encoded, [view, row, column, RGBA] bytes."""

    def __init__(self, device: Device, size: tuple[int, int, int]) -> None:
        """size: columns, rows, views."""
        self._pass = ScreenPass(device, "encode/encode.frag")
        self.images = TextureArray(device, "encoded views", size, gl.RGBA8)
        self.images.parameters(gl.NEAREST, gl.NEAREST, ("clamp", "clamp"))
        self._layer = LayerTarget(device, self.images)

    def __call__(self, linear: ViewImages, exposure: float) -> ViewImages:
        """Encode the rows of all views."""
        for view in range(self.images.layers):
            self._layer.use(view)
            self._pass(
                {},
                {"exposure": exposure, "layer": view},
                {"linear_image": linear.images},
                (0, self.images.height),
                self.images.width,
            )
        return ViewImages(self.images, linear.first, linear.shown)

    def release(self) -> None:
        """Free everything."""
        self._layer.release()
        self.images.release()
        self._pass.release()

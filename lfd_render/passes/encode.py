"""Encoding: scene-linear light → 8-bit sRGB."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lfd_render.gpu import raw as gl
from lfd_render.gpu.device import Device
from lfd_render.gpu.framebuffer import LayerTarget
from lfd_render.gpu.memory import TextureArray
from lfd_render.passes.screen import ScreenPass
from lfd_render.passes.view_target import ViewImages


class Encode:
    """Linear texture layer → uint8 picture: exposure, tone curve, sRGB; of pictures that have had
    theirs (`developed`) sRGB alone."""

    def __init__(self, device: Device, width: int, height: int, *, developed: bool = False) -> None:
        self._developed = developed
        self._pass = ScreenPass(device, "encode/srgb.frag" if developed else "encode/encode.frag")
        self._picture = TextureArray(device, "picture", (width, height, 1), gl.RGBA8)
        self._framebuffer = LayerTarget(device, self._picture)

    def __call__(self, linear: TextureArray, layer: int, exposure: float = 1.0) -> None:
        """Encode one layer of a texture of the picture's size."""
        assert exposure == 1.0 or not self._developed
        light = {} if self._developed else {"exposure": exposure}
        width, height = self._picture.width, self._picture.height
        self._framebuffer.use(0)
        self._pass(
            {},
            {**light, "layer": layer},
            {"linear_image": linear},
            (0, height),
            width,
        )

    def read(self) -> NDArray[np.uint8]:
        """The picture as uint8 [y, x, 3], top row first."""
        self._framebuffer.use(0)
        return self._framebuffer.read_rgb(gl.UNSIGNED_BYTE, np.uint8).astype(np.uint8, copy=False)

    def release(self) -> None:
        """Free everything."""
        self._framebuffer.release()
        self._picture.release()
        self._pass.release()


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

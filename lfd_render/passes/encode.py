"""Encoding: scene-linear light → 8-bit sRGB."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lfd_render.gpu import raw as gl
from lfd_render.gpu.device import Device
from lfd_render.gpu.framebuffer import LayerTarget
from lfd_render.gpu.memory import TextureArray
from lfd_render.passes.screen import ScreenPass


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


class EncodeColor:
    """One colour in linear light → the same encoded, as a device encodes pictures. RGB, 0 to 1."""

    def __init__(self, device: Device) -> None:
        self._encode = Encode(device, 1, 1)
        self._light = TextureArray(device, "picture", (1, 1, 1), gl.RGBA16F)
        self._light.parameters(gl.NEAREST, gl.NEAREST, ("clamp", "clamp"))
        self._last: tuple[object, tuple[float, float, float]] = None, (0.0, 0.0, 0.0)

    def __call__(
        self, color: tuple[float, float, float], exposure: float
    ) -> tuple[float, float, float]:
        """Encode it. Waits for the device if it is another one than the last."""
        if self._last[0] != (color, exposure):
            self._light.clear((*color, 1.0))
            self._encode(self._light, 0, exposure)
            red, green, blue = (self._encode.read()[0, 0] / 255.0).tolist()
            self._last = (color, exposure), (red, green, blue)
        return self._last[1]

    def release(self) -> None:
        """Free everything."""
        self._encode.release()
        self._light.release()

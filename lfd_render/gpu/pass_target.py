"""What a pass over several views draws into: layers of texture arrays, with layered depth.

moderngl attaches neither some layers of an array nor layered depth, so this is raw OpenGL.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lfd_render.errors import UnsupportedError
from lfd_render.gpu import raw as gl
from lfd_render.gpu.memory import Owned, TextureArray

if TYPE_CHECKING:
    from lfd_render.gpu.device import Device

Color = tuple[float, float, float, float]


@dataclass(frozen=True, eq=False)
class Layers:
    """Consecutive layers of a texture array."""

    texture: TextureArray
    first: int
    count: int


class PassTarget(Owned):
    """A framebuffer over layers of texture arrays, each colour of as many, with depth.

    reached: how draws reach the layers: "layer", there is but one; "layered", by gl_Layer;
    "multiview", by gl_ViewID_OVR.
    """

    def __init__(
        self, device: Device, colors: Sequence[Layers], depth: Layers, *, reached: str
    ) -> None:
        super().__init__(device)
        self._colors = colors
        self._views: list[ctypes.c_uint] = []  # textures over some layers of others
        self._name = ctypes.c_uint()
        raw = device.raw
        raw.glCreateFramebuffers(1, ctypes.byref(self._name))
        points = [gl.COLOR_ATTACHMENT0 + i for i in range(len(colors))]
        attach = {
            "layer": self._attach_layer,
            "layered": self._attach_layers,
            "multiview": self._attach_multiview,
        }[reached]
        for point, layers in zip([*points, gl.DEPTH_ATTACHMENT], [*colors, depth], strict=True):
            attach(point, layers)
        raw.glNamedFramebufferDrawBuffers(
            self._name, len(points), (ctypes.c_uint * len(points))(*points)
        )
        status = raw.glCheckNamedFramebufferStatus(self._name, gl.FRAMEBUFFER)
        if status != gl.FRAMEBUFFER_COMPLETE:
            raise UnsupportedError(
                f"framebuffer of {depth.count} layers: {device.name} calls it incomplete "
                f"({status:#x}); use mvr 'multipass'"
            )

    def _attach_layer(self, point: int, layers: Layers) -> None:
        assert layers.count == 1
        self._device.raw.glNamedFramebufferTextureLayer(
            self._name, point, layers.texture.name, 0, layers.first
        )

    def _attach_layers(self, point: int, layers: Layers) -> None:
        self._device.raw.glNamedFramebufferTexture(self._name, point, self._view(layers), 0)

    def _attach_multiview(self, point: int, layers: Layers) -> None:
        raw = self._device.raw
        raw.glBindFramebuffer(gl.FRAMEBUFFER, self._name)
        # Of a view, since the first layer must be the same for all attachments.
        raw.glFramebufferTextureMultiviewOVR(
            gl.FRAMEBUFFER, point, self._view(layers), 0, 0, layers.count
        )

    def _view(self, layers: Layers) -> ctypes.c_uint:
        """These layers as a texture of their own."""
        texture, raw = layers.texture, self._device.raw
        view = ctypes.c_uint()
        raw.glGenTextures(1, ctypes.byref(view))
        self._views.append(view)
        raw.glTextureView(
            view, gl.TEXTURE_2D_ARRAY, texture.name, texture.internal_format, 0, 1,
            layers.first, layers.count,
        )  # fmt: skip
        return view

    def use(self, x: int, y: int, width: int, height: int) -> None:
        """Draw from now on into these pixels of all layers."""
        raw = self._device.raw
        raw.glBindFramebuffer(gl.FRAMEBUFFER, self._name)
        raw.glViewport(x, y, width, height)

    def clear(self, color: Color | int, *, depth: bool = True) -> None:
        """Set all pixels of all layers to a colour, or integers to a number, and depth to
        farthest."""
        raw = self._device.raw
        for index in range(len(self._colors)):
            if isinstance(color, int):
                number = (ctypes.c_uint * 4)(color)
                raw.glClearNamedFramebufferuiv(self._name, gl.COLOR, index, number)
            else:
                value = (ctypes.c_float * 4)(*color)
                raw.glClearNamedFramebufferfv(self._name, gl.COLOR, index, value)
        if depth:
            farthest = ctypes.c_float(1.0)
            raw.glClearNamedFramebufferfv(self._name, gl.DEPTH, 0, ctypes.byref(farthest))

    def _free(self) -> None:
        raw = self._device.raw
        raw.glDeleteFramebuffers(1, ctypes.byref(self._name))
        for view in self._views:
            raw.glDeleteTextures(1, ctypes.byref(view))

"""Raster targets of one picture, raster state, and draws.

moderngl attaches no layer of an immutable array, so this is raw OpenGL.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lfd_render.gpu import raw as gl
from lfd_render.gpu.memory import Buffer, Owned, TextureArray
from lfd_render.gpu.programs import RasterProgram

if TYPE_CHECKING:
    from lfd_render.gpu.device import Device


class LayerTarget(Owned):
    """A framebuffer over one layer at a time of a texture array."""

    def __init__(self, device: Device, texture: TextureArray) -> None:
        super().__init__(device)
        self.texture = texture
        self._name = ctypes.c_uint()
        device.raw.glCreateFramebuffers(1, ctypes.byref(self._name))

    def use(self, layer: int, rows: int | None = None) -> None:
        """Draw into this layer from now on: its first `rows`, all by default."""
        raw = self._device.raw
        raw.glNamedFramebufferTextureLayer(
            self._name, gl.COLOR_ATTACHMENT0, self.texture.name, 0, layer
        )
        raw.glBindFramebuffer(gl.FRAMEBUFFER, self._name)
        raw.glViewport(0, 0, self.texture.width, rows or self.texture.height)

    def read_rgb(self, gl_type: int, dtype: type[np.generic]) -> NDArray[np.generic]:
        """The layer in use as [y, x, 3], row 0 first. Waits for the device."""
        width, height = self.texture.width, self.texture.height
        pixels = np.empty((height, width, 3), dtype)
        raw = self._device.raw
        raw.glBindFramebuffer(gl.READ_FRAMEBUFFER, self._name)
        raw.glPixelStorei(gl.PACK_ALIGNMENT, 1)
        raw.glReadPixels(0, 0, width, height, gl.RGB, gl_type, pixels.ctypes.data)
        return pixels

    def _free(self) -> None:
        self._device.raw.glDeleteFramebuffers(1, ctypes.byref(self._name))


class EmptyTarget(Owned):
    """A framebuffer of some size and no picture: fragments only write to buffers."""

    def __init__(self, device: Device, width: int, height: int) -> None:
        super().__init__(device)
        self._size = width, height
        self._name = ctypes.c_uint()
        raw = device.raw
        raw.glCreateFramebuffers(1, ctypes.byref(self._name))
        raw.glNamedFramebufferParameteri(self._name, gl.FRAMEBUFFER_DEFAULT_WIDTH, width)
        raw.glNamedFramebufferParameteri(self._name, gl.FRAMEBUFFER_DEFAULT_HEIGHT, height)

    def use(self) -> None:
        """Draw into it from now on, whichever way triangles turn."""
        raw = self._device.raw
        raw.glBindFramebuffer(gl.FRAMEBUFFER, self._name)
        raw.glViewport(0, 0, *self._size)
        raw.glDisable(gl.DEPTH_TEST)
        raw.glDisable(gl.CULL_FACE)

    def _free(self) -> None:
        self._device.raw.glDeleteFramebuffers(1, ctypes.byref(self._name))


@contextmanager
def conservative_raster(device: Device, wanted: bool) -> Iterator[None]:
    """Draws inside reach every pixel that a triangle touches, where wanted and the driver can."""
    if wanted:
        device.raw.glEnable(gl.CONSERVATIVE_RASTERIZATION_NV)
    try:
        yield
    finally:
        if wanted:
            device.raw.glDisable(gl.CONSERVATIVE_RASTERIZATION_NV)


@contextmanager
def rasterising(device: Device, clips: int) -> Iterator[None]:
    """Depth tests, and so many clip distances, inside; off again whatever happens."""
    raw = device.raw
    raw.glEnable(gl.DEPTH_TEST)
    raw.glDepthFunc(gl.LESS)
    for index in range(clips):
        raw.glEnable(gl.CLIP_DISTANCE0 + index)
    raw.glCullFace(gl.BACK)
    try:
        yield
    finally:
        for index in range(clips):
            raw.glDisable(gl.CLIP_DISTANCE0 + index)
        raw.glDisable(gl.CULL_FACE)
        raw.glDisable(gl.DEPTH_TEST)
        # While a multiview target is in use compute shaders too may run once a view.
        raw.glBindFramebuffer(gl.FRAMEBUFFER, 0)


@contextmanager
def depth_only(device: Device) -> Iterator[None]:
    """Draws inside write no colour."""
    device.raw.glColorMask(0, 0, 0, 0)
    try:
        yield
    finally:
        device.raw.glColorMask(1, 1, 1, 1)


@contextmanager
def blending_at_equal_depth(device: Device) -> Iterator[None]:
    """Draws inside lie over what is drawn, by their alpha, where their depth is the nearest."""
    raw = device.raw
    raw.glDepthFunc(gl.EQUAL)
    raw.glEnable(gl.BLEND)
    raw.glBlendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA)
    try:
        yield
    finally:
        raw.glDisable(gl.BLEND)
        raw.glDepthFunc(gl.LESS)


@contextmanager
def over_equal_depth(device: Device) -> Iterator[None]:
    """Draws inside win over what is as far."""
    device.raw.glDepthFunc(gl.LEQUAL)
    try:
        yield
    finally:
        device.raw.glDepthFunc(gl.LESS)


def face_culling(device: Device, *, double_sided: bool, mirrored: bool) -> None:
    """Which side the next draws show. Row 0 at the raster's bottom turns windings over."""
    raw = device.raw
    (raw.glDisable if double_sided else raw.glEnable)(gl.CULL_FACE)
    raw.glFrontFace(gl.CCW if mirrored else gl.CW)


class IndexedDraws(Owned):
    """Triangles by an index buffer; vertices are pulled from storage blocks by gl_VertexID."""

    def __init__(self, device: Device, program: RasterProgram, indices: Buffer) -> None:
        super().__init__(device)
        self._vao = device.context.vertex_array(program.glo, [], index_buffer=indices.glo)

    def draw(self, first: int, count: int, instances: int = 1) -> None:
        """Draw `count` triangles from the `first` on, so many times over."""
        self._vao.render(
            self._device.triangles_mode, vertices=3 * count, first=3 * first, instances=instances
        )

    def _free(self) -> None:
        self._vao.release()


class ScreenDraw(Owned):
    """A program run once for each pixel of the target in use."""

    def __init__(self, device: Device, program: RasterProgram) -> None:
        super().__init__(device)
        self._vao = device.context.vertex_array(program.glo, [])

    def draw(self, first_row: int, rows: int, width: int) -> None:
        """Run over some rows of the target."""
        raw = self._device.raw
        raw.glDisable(gl.DEPTH_TEST)
        raw.glDisable(gl.CULL_FACE)
        raw.glEnable(gl.SCISSOR_TEST)
        raw.glScissor(0, first_row, width, rows)
        self._vao.render(self._device.triangles_mode, vertices=3)
        raw.glDisable(gl.SCISSOR_TEST)

    def _free(self) -> None:
        self._vao.release()

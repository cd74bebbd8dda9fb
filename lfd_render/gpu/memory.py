"""Device memory: buffers, textures, and the ledger that counts every byte of them."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import moderngl
import numpy as np
from numpy.typing import DTypeLike, NDArray

from lfd_render.errors import ResourceError
from lfd_render.gpu import raw as gl

if TYPE_CHECKING:
    from lfd_render.gpu.device import Device


_SOFTWARE_TEXTURE_BYTES = 1 << 30  # lavapipe allocates no more at once, llvmpipe twice that
_CGROUP_LIMIT = Path("/sys/fs/cgroup/memory.max")


def texture_bytes(extensions: Collection[str], raw: gl.RawGl, software: bool) -> tuple[int, int]:
    """Bytes that one texture, and all textures of a scene, may take on a device.

    All: half of its own memory where it tells; a quarter of main memory where that is what it uses
    or where nothing is known. One: half of all, and what software devices allocate at once.
    """
    if "GL_NVX_gpu_memory_info" in extensions:
        budget = raw.integer(gl.GPU_MEMORY_INFO_DEDICATED_VIDMEM_NVX) * 1024 // 2
    else:
        budget = main_memory_bytes() // 4
    return min(budget // 2, _SOFTWARE_TEXTURE_BYTES if software else budget), budget


def main_memory_bytes() -> int:
    """The machine's memory, or this process's share where its control group has a limit."""
    total = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    try:
        return min(total, int(_CGROUP_LIMIT.read_text()))
    except (OSError, ValueError):  # no such file, or "max"
        return total


class Owned:
    """Something that lives on a device, which knows it until it is released."""

    def __init__(self, device: Device) -> None:
        self._device = device
        device.owned[self] = None

    def release(self) -> None:
        """Give it back; calling it again does nothing. It must not be used afterwards."""
        if self in self._device.owned:
            del self._device.owned[self]
            self._free()

    def _free(self) -> None:
        raise NotImplementedError


class Ledger:
    """Bytes that live on the device, by label, and their peak."""

    def __init__(self) -> None:
        self.by_label: dict[str, int] = {}
        self.peak = 0

    @property
    def total(self) -> int:
        """Bytes allocated now."""
        return sum(self.by_label.values())

    def restart_peak(self) -> None:
        """Forget past peaks: the peak is what is allocated now."""
        self.peak = self.total

    def add(self, label: str, size: int) -> None:
        """Count an allocation (negative: a release)."""
        self.by_label[label] = self.by_label.get(label, 0) + size
        if not self.by_label[label]:
            del self.by_label[label]
        self.peak = max(self.peak, self.total)


class Buffer(Owned):
    """A storage buffer. Sizes are in bytes; contents travel as numpy arrays."""

    def __init__(
        self, device: Device, label: str, size: int, data: NDArray[np.uint8] | None = None
    ) -> None:
        limit = device.info.max_storage_bytes
        if size > limit:
            raise ResourceError(
                f"device buffer '{label}': {size} bytes exceed the limit of {limit} bytes on "
                f"{device.name}; use fewer or smaller views, or a smaller scene"
            )
        self.label = label
        self.size = max(4, size)
        self._texture = 0  # that samplers read it by, made when one does
        try:
            context = device.context
            self.glo = (
                context.buffer(data)
                if data is not None and size
                else context.buffer(reserve=self.size)
            )
        except moderngl.Error as error:
            raise ResourceError(
                f"device buffer '{label}': {size} bytes cannot be allocated on {device.name} "
                f"({error}); use fewer or smaller views, or a smaller scene"
            ) from None
        super().__init__(device)
        device.ledger.add(label, self.size)

    @classmethod
    def of(cls, device: Device, label: str, array: NDArray[Any]) -> Buffer:
        """A buffer that holds a copy of an array."""
        return cls(device, label, array.nbytes, _bytes(array))

    def write(self, array: NDArray[Any], offset: int = 0) -> None:
        """Copy an array into the buffer at a byte offset."""
        self.glo.write(_bytes(array), offset=offset)

    def read(self, dtype: DTypeLike, count: int = -1) -> NDArray[Any]:
        """The first `count` elements (all by default) as an array. Waits for the device."""
        if count == 0:  # OpenGL maps no empty ranges
            return np.empty(0, dtype)
        size = -1 if count < 0 else count * np.dtype(dtype).itemsize
        return np.frombuffer(self.glo.read(size), dtype=dtype)

    def bind(self, unit: int) -> None:
        """Make the buffer what samplers of this unit read, four 32-bit words a texel: software
        devices gather from it faster than from storage blocks. Raises ResourceError for more texels
        than samplers reach."""
        raw, info = self._device.raw, self._device.info
        if self.size > 16 * info.max_buffer_texels:
            raise ResourceError(
                f"device buffer '{self.label}': {self.size} bytes exceed the "
                f"{16 * info.max_buffer_texels} that samplers of {self._device.name} reach; use "
                "fewer or smaller views, or a smaller scene"
            )
        if not self._texture:
            name = ctypes.c_uint()
            raw.glCreateTextures(gl.TEXTURE_BUFFER, 1, ctypes.byref(name))
            raw.glTextureBuffer(name, gl.RGBA32UI, self.glo.glo)
            self._texture = int(name.value)
        raw.glBindTextureUnit(unit, self._texture)

    def fill(self, word: int) -> None:
        """Set every 32-bit word."""
        # moderngl's own clear maps the buffer and took 35 times as long.
        self._device.raw.glClearNamedBufferData(
            self.glo.glo,
            gl.R32UI,
            gl.RED_INTEGER,
            gl.UNSIGNED_INT,
            ctypes.byref(ctypes.c_uint(word)),
        )

    def _free(self) -> None:
        self._device.ledger.add(self.label, -self.size)
        if self._texture:
            self._device.raw.glDeleteTextures(1, ctypes.byref(ctypes.c_uint(self._texture)))
        self.glo.release()


def _bytes(array: NDArray[Any]) -> NDArray[np.uint8]:
    """An array's bytes in C order, without a copy where they lie so."""
    return np.ascontiguousarray(array).reshape(-1).view(np.uint8)


_BYTES_PER_TEXEL = {
    gl.RGBA8: 4,
    gl.SRGB8_ALPHA8: 4,
    gl.R32UI: 4,
    gl.DEPTH_COMPONENT32F: 4,
    gl.RGBA16F: 8,
    gl.RGBA32F: 16,
    gl.RGBA32UI: 16,
}


class TextureArray(Owned):
    """A 2D array texture with immutable storage: [layer, y, x], row 0 as uploaded."""

    _target = gl.TEXTURE_2D_ARRAY

    def __init__(
        self,
        device: Device,
        label: str,
        size: tuple[int, int, int],
        internal_format: int,
        *,
        levels: int = 1,
    ) -> None:
        """size: (width, height, layers) in texels."""
        width, height, layers = size
        info = device.info
        most_layers = layers if self._target == gl.TEXTURE_CUBE_MAP else info.max_array_layers
        if max(width, height) > info.max_texture_size or layers > most_layers:
            raise ResourceError(
                f"texture '{label}': {width}×{height} with {layers} layers exceeds the limits of "
                f"{device.name} ({info.max_texture_size} texels, {info.max_array_layers} layers); "
                "use smaller or fewer pictures"
            )
        self.label = label
        self.width, self.height, self.layers, self.levels = width, height, layers, levels
        self.internal_format = internal_format
        super().__init__(device)
        name = ctypes.c_uint()
        device.raw.glCreateTextures(self._target, 1, ctypes.byref(name))
        self.name = int(name.value)
        self.size = sum(
            max(1, width >> level) * max(1, height >> level) for level in range(levels)
        ) * (layers * _BYTES_PER_TEXEL[internal_format])
        device.ledger.add(label, self.size)
        self._make_room()
        device.check()

    def _make_room(self) -> None:
        self._device.raw.glTextureStorage3D(
            self.name, self.levels, self.internal_format, self.width, self.height, self.layers
        )

    def upload(
        self, layer: int, pixels: NDArray[np.uint8] | NDArray[np.float32], top: int = 0
    ) -> None:
        """Set rows of level 0 of a layer, from row `top` on, from uint8 or float32 [y, x, 4]."""
        rows = len(pixels)
        assert pixels.shape == (rows, self.width, 4)
        assert top + rows <= self.height
        data = np.ascontiguousarray(pixels)
        kind = gl.UNSIGNED_BYTE if data.dtype == np.uint8 else gl.FLOAT
        self._device.raw.glTextureSubImage3D(
            self.name, 0, 0, top, layer, self.width, rows, 1,
            gl.RGBA, kind, data.ctypes.data,
        )  # fmt: skip

    def copy_level(self, source: TextureArray, level: int, layer: int, top: int) -> None:
        """Set rows of level 0 of a layer, from row `top` on, from a level of a source's layer 0."""
        width, height = max(1, source.width >> level), max(1, source.height >> level)
        assert width == self.width
        assert top + height <= self.height
        self._device.raw.glCopyImageSubData(
            source.name, gl.TEXTURE_2D_ARRAY, level, 0, 0, 0,
            self.name, gl.TEXTURE_2D_ARRAY, 0, 0, top, layer, width, height, 1,
        )  # fmt: skip

    def copy_part(
        self, source: TextureArray, layer: int, corner: tuple[int, int, int], size: tuple[int, int]
    ) -> None:
        """Set the first rows and columns of a layer from as many of a source from (x, y, layer)
        on. size: columns, rows."""
        self._device.raw.glCopyImageSubData(
            source.name, gl.TEXTURE_2D_ARRAY, 0, *corner,
            self.name, gl.TEXTURE_2D_ARRAY, 0, 0, 0, layer, *size, 1,
        )  # fmt: skip

    def generate_mipmaps(self) -> None:
        """Fill levels 1 and up from level 0; sRGB formats average in linear light."""
        self._device.raw.glGenerateTextureMipmap(self.name)

    def parameters(self, minify: int, magnify: int, wrap: Sequence[str]) -> None:
        """Filters (GL enums) and wraps (s, t: ``repeat``, ``clamp`` or ``mirror``)."""
        raw = self._device.raw
        raw.glTextureParameteri(self.name, gl.TEXTURE_MIN_FILTER, minify)
        raw.glTextureParameteri(self.name, gl.TEXTURE_MAG_FILTER, magnify)
        raw.glTextureParameteri(self.name, gl.TEXTURE_WRAP_S, gl.WRAPS[wrap[0]])
        raw.glTextureParameteri(self.name, gl.TEXTURE_WRAP_T, gl.WRAPS[wrap[1]])

    def clear(self, color: tuple[float, float, float, float]) -> None:
        """Set every texel of level 0."""
        value = (ctypes.c_float * 4)(*color)
        self._device.raw.glClearTexImage(self.name, 0, gl.RGBA, gl.FLOAT, value)

    def bind(self, unit: int) -> None:
        """Make the texture what samplers of this unit read."""
        self._device.raw.glBindTextureUnit(unit, self.name)

    def bind_image(self, unit: int, *, writeonly: bool = True, level: int = 0) -> None:
        """Make a level what image stores, and loads unless writeonly, of this unit reach. Loads see
        what was drawn before."""
        if not writeonly:
            self._device.barrier()
        access = gl.WRITE_ONLY if writeonly else gl.READ_WRITE
        raw = self._device.raw
        raw.glBindImageTexture(unit, self.name, level, 1, 0, access, self.internal_format)

    def read(
        self, dtype: DTypeLike, gl_type: int, level: int = 0, *, channels: int = gl.RGBA
    ) -> NDArray[Any]:
        """A level as [layer, y, x, 4], or [layer, y, x] of one channel. Waits for the device."""
        size = (max(1, self.height >> level), max(1, self.width >> level))
        pixels = np.empty((self.layers, *size, *([4] if channels == gl.RGBA else [])), dtype)
        self._device.raw.glGetTextureImage(
            self.name, level, channels, gl_type, pixels.nbytes, pixels.ctypes.data
        )
        return pixels

    def _free(self) -> None:
        self._device.ledger.add(self.label, -self.size)
        self._device.raw.glDeleteTextures(1, ctypes.byref(ctypes.c_uint(self.name)))


class CubeMap(TextureArray):
    """Six square faces around a point, in OpenGL's order, filtered across their edges."""

    _target = gl.TEXTURE_CUBE_MAP

    def __init__(
        self, device: Device, label: str, size: int, internal_format: int, *, levels: int = 1
    ) -> None:
        """size: texels along an edge of a face."""
        super().__init__(device, label, (size, size, 6), internal_format, levels=levels)
        device.raw.glEnable(gl.TEXTURE_CUBE_MAP_SEAMLESS)
        self.parameters(gl.LINEAR_MIPMAP_LINEAR, gl.LINEAR, ("clamp", "clamp"))

    def _make_room(self) -> None:
        self._device.raw.glTextureStorage2D(
            self.name, self.levels, self.internal_format, self.width, self.height
        )


class TableTexture(Owned):
    """A table of four 32-bit words an entry, read by texelFetch: software devices gather from it
    faster than from storage blocks."""

    def __init__(self, device: Device, label: str, words: NDArray[np.uint32]) -> None:
        """words: uint32 [n, 4] or [row, n, 4], n at most the device's texture size."""
        rows, count = (1, *words.shape[:1]) if words.ndim == 2 else words.shape[:2]
        assert words.shape[-1] == 4
        limit = device.info.max_texture_size
        if max(rows, count) > limit:
            raise ResourceError(
                f"table '{label}': {count} entries exceed the {limit} texels of "
                f"{device.name}; use a display of fewer pixels a side"
            )
        self.label = label
        self.size = words.nbytes
        super().__init__(device)
        device.ledger.add(label, self.size)
        name = ctypes.c_uint()
        raw = device.raw
        raw.glCreateTextures(gl.TEXTURE_2D, 1, ctypes.byref(name))
        self.name = int(name.value)
        data = np.ascontiguousarray(words)
        raw.glTextureStorage2D(self.name, 1, gl.RGBA32UI, count, rows)
        raw.glTextureSubImage2D(
            self.name, 0, 0, 0, count, rows, gl.RGBA_INTEGER, gl.UNSIGNED_INT, data.ctypes.data
        )
        raw.glTextureParameteri(self.name, gl.TEXTURE_MIN_FILTER, gl.NEAREST)
        raw.glTextureParameteri(self.name, gl.TEXTURE_MAG_FILTER, gl.NEAREST)
        device.check()

    def bind(self, unit: int) -> None:
        """Make the table what samplers of this unit read."""
        self._device.raw.glBindTextureUnit(unit, self.name)

    def _free(self) -> None:
        self._device.ledger.add(self.label, -self.size)
        self._device.raw.glDeleteTextures(1, ctypes.byref(ctypes.c_uint(self.name)))

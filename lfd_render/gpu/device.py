"""One OpenGL device through EGL: choosing it, describing it, checking it, owning what lives on it.

A context belongs to the thread that opened it and does not survive a fork. This package is the
only one that talks to moderngl; passes see `Device`, `Kernel`, `RasterProgram`, buffers, textures.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import glcontext
import moderngl

from lfd_render.errors import GpuError, ResourceError
from lfd_render.gpu.memory import Ledger, Owned, texture_bytes
from lfd_render.gpu.raw import (
    ERRORS,
    MAX_COMPUTE_SHADER_STORAGE_BLOCKS,
    MAX_GEOMETRY_OUTPUT_VERTICES,
    MAX_GEOMETRY_SHADER_INVOCATIONS,
    MAX_GEOMETRY_SHADER_STORAGE_BLOCKS,
    MAX_GEOMETRY_TOTAL_OUTPUT_COMPONENTS,
    MAX_VIEWS_OVR,
    OUT_OF_MEMORY,
    RawGl,
)

REQUIRED_VERSION = 450
MULTIVIEW = "GL_OVR_multiview2"  # OVR_multiview alone lets nothing but gl_Position depend on a view
GEOMETRY_STORAGE_BLOCKS = 10  # of cells/align.geom
STORAGE_BLOCKS = 16  # of the largest shader; OpenGL promises 8, Mesa offers 16
SOFTWARE_RENDERERS = ("llvmpipe", "softpipe", "swrast", "lavapipe")
INSTALL_HINT = (
    "install the GL libraries (Debian, Ubuntu: apt-get install libegl1 libgl1 libgl1-mesa-dri) "
    "and run 'lfd-render doctor'"
)
_MAX_EGL_DEVICES = 16
_MOST_THREADS = 16  # of llvmpipe


@dataclass(frozen=True)
class DeviceInfo:
    """What a context reports of itself; limits in the units of the GL specification."""

    renderer: str
    vendor: str
    version: str
    egl_index: int
    software: bool
    extensions: frozenset[str]
    max_storage_bytes: int
    max_texture_units: int
    max_array_layers: int
    max_texture_size: int
    max_buffer_texels: int
    max_groups: int
    max_storage_blocks: int  # of a compute shader
    geometry_storage: bool  # whether the geometry stage has storage blocks to speak of
    max_geometry_vertices: int  # that an invocation of the geometry stage emits
    max_geometry_components: int  # of all of them
    max_geometry_invocations: int  # a triangle
    max_multiview: int  # views of a multiview target, 0 without MULTIVIEW
    max_texture_bytes: int  # of one texture with its mip levels
    texture_budget_bytes: int  # of all textures of a scene


class Device:
    """A context, the functions moderngl lacks, and the ledger of what was allocated."""

    triangles_mode: int = moderngl.TRIANGLES

    def __init__(self, loader: Any, egl_index: int) -> None:
        self.context = moderngl.create_context(context=loader)
        self.raw = RawGl(loader)
        self.ledger = Ledger()
        self.owned: dict[Owned, None] = {}  # in the order they were made
        self.info = _describe(self.context, self.raw, egl_index)
        self.closed = False
        self._thread = threading.get_ident()
        if self.info.max_storage_blocks < STORAGE_BLOCKS:
            raise GpuError(
                f"device {self.name}: a compute shader may use {self.info.max_storage_blocks} "
                f"storage blocks and this renderer needs {STORAGE_BLOCKS}; use --device software"
            )

    @classmethod
    def open(cls, choice: str = "auto") -> Device:
        """Open a device: ``auto`` (hardware if any, else software), ``gpu``, ``software``, or the
        index of an EGL device.

        Raises GpuError when none fits, naming what to install.
        """
        if choice.isdecimal():
            return cls(_egl_context(int(choice)), int(choice))
        if choice not in ("auto", "gpu", "software"):
            raise GpuError(f"device '{choice}': unknown; use auto, gpu, software or an EGL index")
        software_index: int | None = None
        for device in _candidates():
            if device.info.software == (choice == "software"):
                return device
            if software_index is None and device.info.software:
                software_index = device.info.egl_index
            device.close()
        if choice != "auto" or software_index is None:
            raise GpuError(
                f"device '{choice}': EGL offers no {'software' if choice == 'software' else 'GPU'} "
                "device here; use auto, or see what there is with 'lfd-render doctor'"
            )
        return cls(_egl_context(software_index), software_index)

    @property
    def name(self) -> str:
        """GL_RENDERER."""
        return self.info.renderer

    @property
    def threads(self) -> int:
        """That share a dispatch, each with a run of its work groups: Mesa's of a device in
        software; 1 for hardware, which has an order of its own."""
        if not self.info.software:
            return 1
        asked = os.environ.get("LP_NUM_THREADS", "")
        threads = int(asked) if asked.isdecimal() else len(os.sched_getaffinity(0))
        return max(1, min(threads, _MOST_THREADS))

    @property
    def lanes(self) -> int:
        """Of a work group that loops over what there is: one vector in software, which pays for
        the start of each."""
        return 8 if self.info.software else 64

    def activate(self) -> None:
        """Make this the thread's current context. Whoever has several calls it before each use."""
        if self.closed:
            raise GpuError("device: it is closed; open another Device or Renderer")
        if threading.get_ident() != self._thread:
            raise GpuError(
                "device: it belongs to the thread that opened it; open a Renderer in each thread"
            )
        self.context.__enter__()  # type: ignore[no-untyped-call]  # moderngl types its methods only

    def finish(self) -> None:
        """Wait until the device has done all that was asked."""
        self.context.finish()

    def barrier(self) -> None:
        """Make shader writes visible to whatever runs next."""
        self.context.memory_barrier()

    def check(self) -> None:
        """Raise GpuError when OpenGL has recorded an error since the last check."""
        code = self.raw.glGetError()
        if code == OUT_OF_MEMORY:
            raise ResourceError(
                f"OpenGL on {self.name}: out of memory; use fewer or smaller views or textures"
            )
        if code:
            raise GpuError(f"OpenGL on {self.name} reports {ERRORS.get(code, hex(code))}")

    @contextmanager
    def undoing(self) -> Iterator[None]:
        """Release what was made inside when it ends in an error."""
        before = set(self.owned)
        try:
            yield
        except BaseException:
            for thing in reversed(list(self.owned)):
                if thing not in before:
                    thing.release()
            raise

    def close(self) -> None:
        """Free everything and the context. Calling it again does nothing."""
        if not self.closed:
            self.activate()
            for thing in reversed(list(self.owned)):
                thing.release()
            self.closed = True
            self.context.release()


def _describe(context: moderngl.Context, raw: RawGl, egl_index: int) -> DeviceInfo:
    info = context.info
    renderer = str(info["GL_RENDERER"])
    software = any(name in renderer.lower() for name in SOFTWARE_RENDERERS)
    max_texture_bytes, texture_budget_bytes = texture_bytes(context.extensions, raw, software)
    return DeviceInfo(
        renderer=renderer,
        vendor=str(info["GL_VENDOR"]),
        version=str(info["GL_VERSION"]),
        egl_index=egl_index,
        software=software,
        extensions=frozenset(context.extensions),
        max_storage_bytes=int(info["GL_MAX_SHADER_STORAGE_BLOCK_SIZE"]),
        max_texture_units=int(info["GL_MAX_TEXTURE_IMAGE_UNITS"]),
        max_array_layers=int(info["GL_MAX_ARRAY_TEXTURE_LAYERS"]),
        max_buffer_texels=int(info["GL_MAX_TEXTURE_BUFFER_SIZE"]),
        max_texture_size=int(info["GL_MAX_TEXTURE_SIZE"]),
        max_groups=int(info["GL_MAX_COMPUTE_WORK_GROUP_COUNT"][0]),
        max_storage_blocks=raw.integer(MAX_COMPUTE_SHADER_STORAGE_BLOCKS),
        geometry_storage=raw.integer(MAX_GEOMETRY_SHADER_STORAGE_BLOCKS) >= GEOMETRY_STORAGE_BLOCKS,
        max_geometry_vertices=raw.integer(MAX_GEOMETRY_OUTPUT_VERTICES),
        max_geometry_components=raw.integer(MAX_GEOMETRY_TOTAL_OUTPUT_COMPONENTS),
        max_geometry_invocations=raw.integer(MAX_GEOMETRY_SHADER_INVOCATIONS),
        max_multiview=raw.integer(MAX_VIEWS_OVR) if MULTIVIEW in context.extensions else 0,
        max_texture_bytes=max_texture_bytes,
        texture_budget_bytes=texture_budget_bytes,
    )


def _egl_context(index: int) -> Any:
    try:
        backend = glcontext.get_backend_by_name("egl")
        return backend(mode="standalone", glversion=REQUIRED_VERSION, device_index=index)
    except Exception as error:  # glcontext raises bare Exception for whatever EGL refuses
        raise GpuError(
            f"EGL device {index}: OpenGL {REQUIRED_VERSION / 100:.1f} unavailable ({error}); "
            + INSTALL_HINT
        ) from None


def _candidates() -> Iterator[Device]:
    """Each EGL device that gives a context, in EGL's order."""
    first_error: GpuError | None = None
    opened = False
    for index in range(_MAX_EGL_DEVICES):
        try:
            loader = _egl_context(index)
        except GpuError as error:
            first_error = first_error or error
            if "device index" in str(error) or "libEGL" in str(error):
                break
            continue
        opened = True
        yield Device(loader, index)
    if not opened and first_error is not None:
        raise first_error

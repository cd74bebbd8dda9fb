"""A fragment program over every pixel of a target."""

from __future__ import annotations

from collections.abc import Mapping

from lfd_render.gpu.device import Device
from lfd_render.gpu.framebuffer import ScreenDraw
from lfd_render.gpu.memory import Buffer
from lfd_render.gpu.programs import RasterProgram, Samplers, Uniform


class ScreenPass:
    """One fragment shader run over rows of the framebuffer in use."""

    def __init__(
        self, device: Device, fragment_path: str, constants: Mapping[str, int | float] | None = None
    ) -> None:
        self._program = RasterProgram(device, "common/screen.vert", fragment_path, constants)
        self._draw = ScreenDraw(device, self._program)

    def __call__(
        self,
        buffers: Mapping[str, Buffer],
        uniforms: Mapping[str, Uniform],
        samplers: Samplers,
        rows: tuple[int, int],
        width: int,
    ) -> None:
        """Run over rows [first, end) of the target in use, `width` pixels wide."""
        self._program.set(buffers, uniforms, samplers)
        self._draw.draw(rows[0], rows[1] - rows[0], width)

    def release(self) -> None:
        """Free the program."""
        self._draw.release()
        self._program.release()

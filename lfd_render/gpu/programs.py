"""Compiled shaders: storage blocks, uniforms and samplers are set by name, a wrong name raises.

A buffer is bound as the shader declares its name: a storage or uniform block, or a usamplerBuffer.
"""

from __future__ import annotations

import ctypes
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import moderngl

from lfd_render.errors import GpuError
from lfd_render.gpu.memory import Buffer, Owned, TableTexture, TextureArray
from lfd_render.gpu.shaders import Source, assemble

if TYPE_CHECKING:
    from lfd_render.gpu.device import Device

# Names of storage and uniform blocks, and of single uniforms and uniform arrays.
_DECLARATION = re.compile(r"\b(?:buffer|uniform)\s+(?:\w+\s+)?(\w+)\s*(?:\[[^\]]*\])?\s*[;{]")
_IMAGE = re.compile(r"\bu?image\w+\s+(\w+)\s*;")

Uniform = int | float | tuple[Any, ...] | bytes
Texture = TextureArray | TableTexture | Buffer
Samplers = Mapping[str, "Texture | list[TextureArray]"]


class _Program(Owned):
    """What compute and raster programs share: binding by name."""

    def __init__(self, device: Device, path: str, text: str, program: Any) -> None:
        super().__init__(device)
        self.path = path
        self._program = program
        self._declared = set(_DECLARATION.findall(text))
        self._blocks: dict[str, tuple[bool, int]] = {}  # name → (storage, binding)
        self._uniforms: set[str] = set()
        images = _IMAGE.findall(text)  # images state their binding in the source
        for name in program:
            member = program[name]
            if isinstance(member, moderngl.StorageBlock | moderngl.UniformBlock):
                # Storage and uniform blocks count apart.
                storage = isinstance(member, moderngl.StorageBlock)
                member.binding = sum(kind == storage for kind, _ in self._blocks.values())
                self._blocks[name] = (storage, member.binding)
            elif isinstance(member, moderngl.Uniform) and name not in images:
                self._uniforms.add(name)

    def set(
        self,
        buffers: Mapping[str, Buffer],
        uniforms: Mapping[str, Uniform] | None = None,
        samplers: Samplers | None = None,
    ) -> None:
        """Bind what the next run reads and writes, by the names in the shader's source.

        A name that the source lacks raises, and so does a missing one. What a compiler has removed
        as unused may be given; compilers differ in that.
        """
        given = {*buffers, *(uniforms or {}), *(samplers or {})}
        missing = {*self._blocks, *self._uniforms} - given
        unknown = given - self._declared
        if missing or unknown:
            raise GpuError(
                f"shader '{self.path}': lacks {sorted(missing)}, does not know {sorted(unknown)}"
            )
        for name, buffer in buffers.items():
            if name not in self._blocks:
                continue
            storage, binding = self._blocks[name]
            if storage:
                buffer.glo.bind_to_storage_buffer(binding)
            else:
                buffer.glo.bind_to_uniform_block(binding)
        self._set_samplers({**(samplers or {}), **buffers})
        for name, value in (uniforms or {}).items():
            if name not in self._uniforms:
                continue
            uniform = self._program[name]
            if isinstance(value, bytes):
                uniform.write(value)
            else:
                uniform.value = value

    def change(self, name: str, value: int | float) -> None:
        """Set a uniform once more; what else was set stays. Unused ones may be given."""
        if name in self._uniforms:
            self._program[name].value = value

    def _set_samplers(self, samplers: Samplers) -> None:
        unit = 0
        for name, textures in samplers.items():
            if name not in self._uniforms:
                continue
            group: Sequence[Texture] = textures if isinstance(textures, list) else [textures]
            for offset, texture in enumerate(group):
                texture.bind(unit + offset)
            # moderngl 5.13 does not know samplers of buffers.
            units = (ctypes.c_int * len(group))(*range(unit, unit + len(group)))
            self._device.raw.glProgramUniform1iv(
                self._program.glo, self._program[name].location, len(group), units
            )
            unit += len(group)

    def _free(self) -> None:
        self._program.release()


class Kernel(_Program):
    """A compute shader."""

    def __init__(
        self, device: Device, path: str, constants: Mapping[str, int | float] | None = None
    ) -> None:
        source = assemble(path, constants)
        super().__init__(
            device, path, source.text, _compile(source, device.context.compute_shader, source.text)
        )

    def run(self, groups: tuple[int, int, int]) -> None:
        """Dispatch that many work groups, then make their writes visible."""
        if min(groups) > 0:
            assert max(groups) <= self._device.info.max_groups, f"{self.path}: {groups} groups"
            self._program.run(*groups)
            self._device.barrier()

    def run_indirect(self, buffer: Buffer, offset: int = 0) -> None:
        """Dispatch as many groups as three words of a buffer say, at a byte offset."""
        self._program.run_indirect(buffer.glo, offset)
        self._device.barrier()


class RasterProgram(_Program):
    """A vertex and a fragment shader, with a geometry shader between them or without."""

    def __init__(
        self,
        device: Device,
        vertex_path: str,
        fragment_path: str,
        constants: Mapping[str, int | float] | None = None,
        *,
        geometry_path: str | None = None,
    ) -> None:
        vertex, fragment = assemble(vertex_path, constants), assemble(fragment_path, constants)
        geometry = assemble(geometry_path, constants) if geometry_path else None

        def build(vertex_text: str) -> Any:
            return device.context.program(
                vertex_shader=vertex_text,
                geometry_shader=geometry.text if geometry else None,
                fragment_shader=fragment.text,
            )

        super().__init__(
            device,
            " + ".join(path for path in (vertex_path, geometry_path, fragment_path) if path),
            vertex.text + (geometry.text if geometry else "") + fragment.text,
            _compile(fragment, build, vertex.text, {"vertex": vertex, "geometry": geometry}),
        )

    @property
    def glo(self) -> Any:
        """The moderngl program, for vertex arrays made inside this package."""
        return self._program


def _compile(
    source: Source, build: Any, text: str, stages: Mapping[str, Source | None] | None = None
) -> Any:
    """Build, and tell a failure in terms of the source, or of the stage that the message names."""
    try:
        return build(text)
    except moderngl.Error as error:
        for stage, other in (stages or {}).items():
            if other and f"{stage}_shader" in str(error):
                source = other
        raise GpuError(f"shader '{source.path}': {source.explain(str(error))}") from None

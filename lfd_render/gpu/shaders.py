"""Shader sources: nested includes, constants, and compiler messages in terms of our files.

``#include "common/shear.glsl"`` takes a path from ``shaders/``, each file once a program;
``#include "layout/Draw"`` declares a struct of :mod:`lfd_render.gpu.layout`. The macros given to
`assemble`, and the layout's constants, are defined right after the version line.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from lfd_render.data import data_folder
from lfd_render.errors import GpuError
from lfd_render.gpu import layout

VERSION_LINE = "#version 450 core"
_INCLUDE = re.compile(r'^\s*#include\s+"([^"]+)"\s*$')
# Mesa: "0:12(3): error: …"; NVIDIA: "0(12) : error …"
_LOCATION = re.compile(r"\b0(?::(\d+)\(\d+\)|\((\d+)\))")
# Mesa 22.3 forgets the source-string number of #line, so line numbers carry the file.
_LINES_A_FILE = 100_000


@dataclass
class Source:
    """An assembled shader: its text, and the files behind the lines of its #line directives."""

    path: str
    text: str
    files: list[str] = field(default_factory=list)

    def explain(self, message: str) -> str:
        """A compiler's message with file names for file numbers."""

        def place(match: re.Match[str]) -> str:
            number, line = divmod(int(match[1] or match[2]), _LINES_A_FILE)
            known = number < len(self.files)
            return f"shaders/{self.files[number]}:{line}" if known else match[0]

        return _LOCATION.sub(place, message)


def assemble(path: str, constants: Mapping[str, int | float] | None = None) -> Source:
    """Read a shader and all that it includes.

    path: below ``shaders/``, for example ``splat/depth.comp``. constants: macros to define;
    names are upper case. Raises GpuError for a missing or unreadable include.
    """
    source = Source(path, "")
    defines = {**layout.CONSTANTS, **(constants or {})}
    assert all(name.isupper() for name in defines), "shader constants are upper case"
    lines = [
        VERSION_LINE,
        *(f"#define {name} {_literal(value)}" for name, value in defines.items()),
    ]
    _append(source, lines, path, data_folder("shaders"))
    source.text = "\n".join(lines) + "\n"
    return source


def _literal(value: int | float) -> str:
    return f"{value}u" if isinstance(value, int) and value >= 1 << 31 else str(value)


def _append(source: Source, lines: list[str], path: str, folder: Path) -> None:
    """Append one file's lines, each include in its place, with #line directives."""
    number = len(source.files)
    source.files.append(path)
    lines.append(f"#line {number * _LINES_A_FILE + 1}")
    for line_number, line in enumerate(_read(path, folder), start=1):
        match = _INCLUDE.match(line)
        if match is None:
            lines.append(line)
            continue
        if match[1] not in source.files:
            _append(source, lines, match[1], folder)
        lines.append(f"#line {number * _LINES_A_FILE + line_number + 1}")


def _read(path: str, folder: Path) -> list[str]:
    if path.startswith("layout/"):
        return layout.glsl(path.removeprefix("layout/")).splitlines()
    try:
        return (folder / path).read_text(encoding="utf-8").splitlines()
    except OSError as error:
        raise GpuError(f"shader '{path}': cannot be read ({error}); reinstall lfd-render") from None

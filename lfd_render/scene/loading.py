"""From a path or a built-in's name to a Scene, with every error naming its source in one line."""

from __future__ import annotations

from pathlib import Path

from lfd_render.errors import LfdError, SceneError

from .builtin import PREFIX, load_builtin
from .model import Scene

_MESSAGE_LIMIT = 500  # characters; names in a file can be of any length


def load_scene(source: str | Path) -> Scene:
    """Read the scene; the errors' texts start with the source and hold no control characters."""
    try:
        if isinstance(source, str) and source.startswith(PREFIX):
            return load_builtin(source)
        return _load_file(Path(source))
    except LfdError as error:
        raise type(error)(_one_line(f"{source}: {error}")) from None


def _load_file(path: Path) -> Scene:
    suffix = path.suffix.lower()
    raise SceneError(f"suffix: '{suffix}'; give a .gltf, .glb or .obj file, or builtin:NAME")


def _one_line(message: str) -> str:
    """The message without line breaks or terminal codes, and not endless."""
    clean = "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in message)
    return clean if len(clean) <= _MESSAGE_LIMIT else clean[: _MESSAGE_LIMIT - 1] + "…"

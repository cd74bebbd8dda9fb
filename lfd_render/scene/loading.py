"""From a path or a built-in's name to a Scene, with every error naming its source in one line."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from lfd_render.errors import LfdError, ResourceError, SceneError

from .builtin import PREFIX, load_builtin
from .gltf import load_gltf
from .limits import LoadLimits
from .model import Scene

_MESSAGE_LIMIT = 500  # characters; names in a file can be of any length


_LOADERS: dict[str, Callable[[Path, LoadLimits], Scene]] = {".gltf": load_gltf, ".glb": load_gltf}


def load_scene(source: str | Path, limits: LoadLimits) -> Scene:
    """Read the scene; the errors' texts start with the source and hold no control characters."""
    try:
        if isinstance(source, str) and source.startswith(PREFIX):
            return load_builtin(source)
        return _load_file(Path(source), limits)
    except LfdError as error:
        raise type(error)(_one_line(f"{source}: {error}")) from None


def _load_file(path: Path, limits: LoadLimits) -> Scene:
    suffix = path.suffix.lower()
    if suffix not in _LOADERS:
        raise SceneError(f"suffix: '{suffix}'; give {', '.join(_LOADERS)} or builtin:NAME")
    scene = _LOADERS[suffix](path, limits)
    if scene.triangle_count > limits.drawn_triangles:
        raise ResourceError(
            f"instances: {scene.triangle_count} triangles drawn; the limit is "
            f"{limits.drawn_triangles}, give a smaller scene"
        )
    return scene


def _one_line(message: str) -> str:
    """The message without line breaks or terminal codes, and not endless."""
    clean = "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in message)
    return clean if len(clean) <= _MESSAGE_LIMIT else clean[: _MESSAGE_LIMIT - 1] + "…"

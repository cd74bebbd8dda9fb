"""From a path or a built-in's name to a Scene, with every error naming its source in one line."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from lfd_render.errors import LfdError, ResourceError, SceneError
from lfd_render.scene.builtin import PREFIX, load_builtin
from lfd_render.scene.findings import findings
from lfd_render.scene.gltf import load_gltf
from lfd_render.scene.limits import LoadLimits
from lfd_render.scene.model import Scene
from lfd_render.scene.obj import load_obj

_MESSAGE_LIMIT = 500  # characters; names in a file can be of any length


_LOADERS: dict[str, Callable[[Path, LoadLimits], Scene]] = {
    ".gltf": load_gltf,
    ".glb": load_gltf,
    ".obj": load_obj,
}


def load_scene(source: str | Path, limits: LoadLimits) -> Scene:
    """Read the scene; the errors' texts start with the source and hold no control characters."""
    try:
        # What overflows becomes infinite and is refused, with its field, by the scene's own checks.
        with np.errstate(all="ignore"):
            return _load(source, limits)
    except LfdError as error:
        raise type(error)(_one_line(f"{source}: {error}")) from None


def _load(source: str | Path, limits: LoadLimits) -> Scene:
    if isinstance(source, str) and source.startswith(PREFIX):
        return load_builtin(source)
    return _load_file(Path(source), limits)


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
    return replace(scene, warnings=(*scene.warnings, *findings(scene)))


def _one_line(message: str) -> str:
    """The message without line breaks or terminal codes; an overlong one loses its middle."""
    clean = "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in message)
    if len(clean) <= _MESSAGE_LIMIT:
        return clean
    half = _MESSAGE_LIMIT // 2
    return f"{clean[: half - 1]}…{clean[-half:]}"

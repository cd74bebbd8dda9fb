"""Hashes by which a sequence knows what its frames were made of."""

from __future__ import annotations

import hashlib
from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np

from lfd_render.scene import Environment, Scene


def scene_digest(scene: Scene) -> str:
    """A hash of all that a scene shows, from whatever files it was read."""
    return _digest(replace(scene, name="", warnings=()))


def environment_digest(environment: Environment) -> str:
    """A hash of an environment's light."""
    return _digest(environment.pixels)


def _digest(thing: object) -> str:
    digest = hashlib.sha256()
    _feed(digest, thing)
    return digest.hexdigest()[:32]


def _feed(digest: hashlib._Hash, thing: Any) -> None:
    if isinstance(thing, np.ndarray):
        digest.update(repr((thing.dtype.str, thing.shape)).encode())
        digest.update(np.ascontiguousarray(thing).data)
    elif isinstance(thing, tuple):
        digest.update(f"({len(thing)}".encode())
        for part in thing:
            _feed(digest, part)
    elif is_dataclass(thing):
        digest.update(type(thing).__name__.encode())
        for part in fields(thing):
            _feed(digest, getattr(thing, part.name))
    else:
        assert thing is None or isinstance(thing, str | bool | int | float | dict), type(thing)
        digest.update(f"{thing!r};".encode())

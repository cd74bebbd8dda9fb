"""Older forms of the profile file, brought to the present one step at a time.

A step takes the plain data of a file of its version and returns that of the next; it must lose
nothing. Each version that was ever released keeps its step for good. The present version is the
first one, so there is no step yet.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from lfd_render.display.model import SCHEMA
from lfd_render.errors import ProfileError

Step = Callable[[dict[str, Any]], dict[str, Any]]

STEPS: Mapping[str, Step] = MappingProxyType({})


def to_present(
    data: dict[str, Any], source: str, steps: Mapping[str, Step] = STEPS
) -> dict[str, Any]:
    """Data of a file of the present version that says the same as one of any version.

    Raises ProfileError for a version that is not known. Data that names none stays as it is.
    """
    for _ in range(len(steps) + 1):
        version = data.get("schema")
        if version == SCHEMA or "schema" not in data:
            return data
        step = steps.get(version) if isinstance(version, str) else None
        if step is None:
            break
        data = step(data)
    known = " or ".join(repr(name) for name in (*steps, SCHEMA))
    raise ProfileError(
        f"{source}: schema is {data['schema']!r:.60}; it should be {known}, "
        "or be read by a newer version of this program"
    )

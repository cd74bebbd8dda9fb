"""Displays by name: those shipped, and those that people put."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from lfd_render.display import DisplayProfile
from lfd_render.display.profile import AUTO, shipped_profiles
from lfd_render.errors import ProfileError

from .problems import ProblemError


class DisplayStore:
    """Profiles in files ``<name>.json`` of a folder, beside the shipped ones, which stay."""

    def __init__(self, folder: Path, most: int) -> None:
        self._folder, self._most = folder, most
        folder.mkdir(parents=True, exist_ok=True)
        self._profiles = {name: DisplayProfile.load(name) for name in shipped_profiles()}
        for file in sorted(folder.glob("*.json")):
            self._profiles[file.stem] = DisplayProfile.load(file)

    def all(self) -> dict[str, DisplayProfile]:
        """All of them by name."""
        return dict(sorted(self._profiles.items()))

    def get(self, name: str) -> DisplayProfile:
        """The profile of a name. Raises ProblemError 404."""
        try:
            return self._profiles[name]
        except KeyError:
            raise ProblemError(
                404, f"display '{name}': unknown; /v1/displays lists those there are", "display"
            ) from None

    def told(self, given: str | dict[str, Any]) -> DisplayProfile:
        """The profile of a name, or the one spelt out. Raises ProblemError 404, ProfileError."""
        return self.get(given) if isinstance(given, str) else inline(json.dumps(given))

    def put(self, name: str, text: str) -> tuple[DisplayProfile, bool]:
        """Keep the profile of a text under a name; whether the name is new.

        Raises ProfileError, ProblemError 409 for a shipped name, 507 when there are too many.
        """
        self._check_own(name)
        new = name not in self._profiles
        if new and len(self._profiles) >= self._most + len(shipped_profiles()):
            raise ProblemError(507, f"there are {self._most} displays; delete one first", "name")
        profile = DisplayProfile.from_json(text, "body")
        profile.save(self._folder / f"{name}.json")
        self._profiles[name] = profile
        return profile, new

    def delete(self, name: str) -> None:
        """Forget a display. Raises ProblemError 404, 409 for a shipped name."""
        self.get(name)
        self._check_own(name)
        (self._folder / f"{name}.json").unlink(missing_ok=True)
        del self._profiles[name]

    def _check_own(self, name: str) -> None:
        if is_shipped(name):
            raise ProblemError(409, f"display '{name}': is shipped and stays; take another", "name")


def is_shipped(name: str) -> bool:
    """Whether a name cannot be taken."""
    return name in shipped_profiles() or name == AUTO


def inline(profile: str) -> DisplayProfile:
    """The profile of a request's JSON. Raises ProfileError."""
    try:
        return DisplayProfile.from_json(profile, "display")
    except RecursionError:
        raise ProfileError("display: is nested too deeply; give a profile") from None

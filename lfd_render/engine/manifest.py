"""A sequence's manifest: its settings, and a line with the SHA-256 of each finished frame.

JSON Lines, so that a frame costs one appended line however many there are: first
``{"schema": "lfd-sequence/1", "settings": {…}}``, then ``{"file": NAME, "sha256": HASH}``; of two
lines about a file the later one counts.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from lfd_render.errors import LfdError, OutputError

MANIFEST = "manifest.jsonl"
SCHEMA = "lfd-sequence/1"


@dataclass
class Manifest:
    """settings: by dotted names; hashes: by file. source: what messages call it."""

    source: str
    settings: dict[str, Any]
    hashes: dict[str, str] = field(default_factory=dict)

    def check(self, settings: Mapping[str, Any]) -> None:
        """Raise OutputError, naming the setting, where one of these differs from the manifest's."""
        for name, value in settings.items():
            if self.settings.get(name) != value:
                raise OutputError(
                    f"{self.source}: setting '{name}' is {json.dumps(self.settings.get(name))} "
                    f"there and {json.dumps(value)} now; give the same, or another folder"
                )

    def head(self) -> str:
        """The first line."""
        return _line({"schema": SCHEMA, "settings": self.settings})

    def text(self) -> str:
        """All lines."""
        return self.head() + "".join(frame_line(name, sha) for name, sha in self.hashes.items())

    @staticmethod
    def parse(text: str, source: str, error: type[LfdError] = OutputError) -> Manifest:
        """The manifest of a file's text; a last line without its end is left out. Raises
        `error` for anything else that is none."""
        lines = text.split("\n")[:-1]
        try:
            head = json.loads(lines[0])
            schema, settings = head["schema"], head["settings"]
            if schema != SCHEMA or not isinstance(settings, dict):
                raise ValueError
        except (IndexError, ValueError, KeyError, TypeError):
            raise error(
                f"{source}: line 1: is not the head of a '{SCHEMA}' manifest; "
                "give a folder that 'animate' made, or another one"
            ) from None
        manifest = Manifest(source, settings)
        for number, line in enumerate(lines[1:], 2):
            try:
                frame = json.loads(line)
                manifest.hashes[str(frame["file"])] = str(frame["sha256"])
            except (ValueError, KeyError, TypeError):
                raise error(
                    f"{source}: line {number}: '{line[:60]}' tells of no frame; remove the line, "
                    "and --resume makes its frame again"
                ) from None
        return manifest


def frame_line(name: str, sha256: str) -> str:
    """The line of a frame."""
    return _line({"file": name, "sha256": sha256})


def _line(value: object) -> str:
    return json.dumps(value, ensure_ascii=False) + "\n"

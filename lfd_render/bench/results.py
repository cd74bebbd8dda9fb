"""Results on disk: a line a group, added as it is done, so that a run can stop and go on."""

from __future__ import annotations

import dataclasses
import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from lfd_render.bench.row import Row
from lfd_render.display.files import replacing
from lfd_render.errors import OutputError, UsageError

SCHEMA = "lfd-bench/2"
LINES = "results.jsonl"
_MAY_DIFFER = ("machine.date", "machine.commit", "machine.python")  # from one sitting to the next


class Results:
    """The lines of a folder: settings first, then groups.

    Raises UsageError where the folder holds results of other settings, OutputError where it cannot
    be written or what it holds makes no sense.
    """

    def __init__(self, folder: Path, settings: Mapping[str, Any]) -> None:
        self.path = folder / LINES
        self.settings = json.loads(json.dumps(settings))
        self.groups: dict[str, list[Row]] = {}
        try:
            folder.mkdir(exist_ok=True)
            text = self.path.read_text(encoding="utf-8") if self.path.exists() else ""
        except (OSError, UnicodeDecodeError) as error:
            raise OutputError(
                f"{self.path}: cannot be read ({error}); use another folder"
            ) from error
        lines = text.splitlines(keepends=True)
        if lines and not lines[-1].endswith("\n"):
            lines.pop()  # cut off while it was written: that group is measured anew
        if not lines:
            self._rewrite("")
            self._append({"schema": SCHEMA, "settings": self.settings})
            return
        self._check(lines[0])
        self.groups = _groups(self.path, lines[1:])
        self._rewrite("".join(lines))

    def _check(self, line: str) -> None:
        found = _settings(self.path, line)
        now_all, before_all = _flat(self.settings), _flat(found)
        for name in sorted(now_all.keys() | before_all.keys()):
            now, before = now_all.get(name), before_all.get(name)
            if now != before and name not in _MAY_DIFFER:
                raise UsageError(
                    f"{self.path}: was measured with {name} {before}, not {now}; go on with the "
                    "same settings, or use another folder"
                )
        self.settings = found

    def add(self, rows: Sequence[Row]) -> None:
        """One more group, on the disk when this returns."""
        self.groups[rows[0].group] = list(rows)
        self._append({"rows": [dataclasses.asdict(row) for row in rows]})

    def done(self, key: str) -> bool:
        """Whether a group is measured; one in which nobody could do anything is tried again."""
        return any(row.valid or row.fault for row in self.groups.get(key, []))

    @property
    def rows(self) -> list[Row]:
        """All rows, in the order of their groups."""
        return [row for rows in self.groups.values() for row in rows]

    def _rewrite(self, text: str) -> None:
        with replacing(self.path) as temporary:
            temporary.write_text(text, encoding="utf-8")

    def _append(self, data: Mapping[str, Any]) -> None:
        try:
            with self.path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(data) + "\n")
                file.flush()
                os.fsync(file.fileno())
        except OSError as error:
            raise OutputError(f"{self.path}: {error.strerror}; use another folder") from error


def read_groups(folder: Path) -> dict[str, list[Row]]:
    """The groups of a run, whole ones only. Raises OutputError where there are none."""
    path = folder / LINES
    try:
        lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    except (OSError, UnicodeDecodeError) as error:
        raise OutputError(f"{path}: cannot be read ({error}); name a folder of a run") from error
    if not lines:
        raise OutputError(f"{path}: is empty; name a folder of a run")
    _settings(path, lines[0])
    return _groups(path, [line for line in lines[1:] if line.endswith("\n")])


def _settings(path: Path, line: str) -> dict[str, Any]:
    try:
        head = json.loads(line)
        schema, found = head["schema"], dict(head["settings"])
    except (ValueError, TypeError, KeyError) as error:
        raise OutputError(f"{path}: line 1 has no settings; use another folder") from error
    if schema != SCHEMA:
        raise OutputError(f"{path}: schema {schema!r}, not {SCHEMA!r}; use another folder")
    return found


def _groups(path: Path, lines: Sequence[str]) -> dict[str, list[Row]]:
    """Of the lines after the first; of a group's lines the last."""
    groups: dict[str, list[Row]] = {}
    for number, line in enumerate(lines, 2):
        try:
            rows = [row_from_json(data) for data in json.loads(line)["rows"]]
            groups[rows[0].group] = rows
        except (ValueError, TypeError, KeyError, IndexError) as error:
            raise OutputError(
                f"{path}: line {number} is no group of rows ({error}); remove it, or use "
                "another folder"
            ) from error
    return groups


def _flat(settings: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    """Settings of settings under names with dots."""
    found: dict[str, Any] = {}
    for name, value in settings.items():
        if isinstance(value, dict):
            found |= _flat(value, f"{before}{name}.")
        else:
            found[before + name] = value
    return found


def row_from_json(data: Mapping[str, Any]) -> Row:
    """A row as `dataclasses.asdict` made it. Raises TypeError or KeyError for other data."""
    row = Row(**data)
    row.suites = tuple(row.suites)
    row.supersample = (int(row.supersample[0]), int(row.supersample[1]))
    row.view_size = (int(row.view_size[0]), int(row.view_size[1]))
    return row

"""The numbers of an OBJ file as arrays, read in bulk: no Python loop touches a vertex or a face.

Lines are told apart by their first bytes, and all lines of a kind go through one number parser
together; only when that fails is the offending line looked for.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from lfd_render.errors import SceneError

_BLANK, _NEWLINE = 32, 10
_TO_SPACE = bytes.maketrans(b"\t\v\f", b"   ")
_CORNER = re.compile(r"[+-]?\d+(/([+-]?\d+)?){0,2}")
_SHOWN = 60  # characters of a wrong line that a message repeats


@dataclass(frozen=True, eq=False)
class ObjTables:
    """What the lines of an OBJ file say, with indices from 0 and −1 where one is absent.

    `corners` is [corner, (v, vt, vn)]; `face_sizes` and `face_lines` are [face]: corners of
    each face, and the line it stands on (from 0). `statements` are the lines that hold no numbers.
    """

    positions: NDArray[np.float64]  # [n, 3]
    colors: NDArray[np.float64] | None  # [n, 3] as written, or None
    texcoords: NDArray[np.float64]  # [t, 2], v upwards
    normals: NDArray[np.float64]  # [k, 3]
    corners: NDArray[np.int64]
    face_sizes: NDArray[np.int64]
    face_lines: NDArray[np.int64]
    statements: list[tuple[int, str, str]]  # line, keyword, the rest


def read_tables(data: bytes) -> ObjTables:
    """Parse the text of an OBJ file; raises SceneError naming the line."""
    lines = _Lines(data)
    vertices, vertex_sizes = lines.numbers(b"v", np.float64)
    positions, colors = _positions(lines, vertices, vertex_sizes)
    texcoords = _columns(lines, b"vt", 1, 2)
    normals = _columns(lines, b"vn", 3, 3)
    corners, face_sizes = _corners(lines, (len(positions), len(texcoords), len(normals)))
    return ObjTables(
        positions=positions,
        colors=colors,
        texcoords=texcoords,
        normals=normals,
        corners=corners,
        face_sizes=face_sizes,
        face_lines=np.flatnonzero(lines.kind(b"f")),
        statements=lines.statements(),
    )


class _Lines:
    """The text cut into lines, with a count of words each."""

    def __init__(self, data: bytes) -> None:
        text = data.translate(_TO_SPACE)
        if b"\r" in text:
            text = text.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
        if b"\\\n" in text:
            # The same number of lines is kept, so that messages name the right one.
            text = re.sub(rb"((?:[^\n]*\\\n)+)([^\n]*)", _join_continued, text)
        if b"#" in text:
            text = re.sub(rb"#[^\n]*", b"", text)
        if text.startswith(b" ") or b"\n " in text:
            text = re.sub(rb"(?m)^ +", b"", text)
        text += b"\n"
        self._codes = np.frombuffer(text, np.uint8)
        ends = np.flatnonzero(self._codes == _NEWLINE)
        self._starts = np.concatenate(([0], ends[:-1] + 1))
        self._lengths = ends + 1 - self._starts
        self._words = _count_between(_word_starts(self._codes), self._starts)
        self._kinds: dict[bytes, NDArray[np.bool_]] = {}

    def kind(self, keyword: bytes) -> NDArray[np.bool_]:
        """Which lines, [line], start with a keyword."""
        if keyword not in self._kinds:
            found = self._lengths > len(keyword)
            last = len(self._codes) - 1
            for i, code in enumerate(keyword + b" "):
                found &= self._codes[np.minimum(self._starts + i, last)] == code
            self._kinds[keyword] = found
        return self._kinds[keyword]

    def numbers(
        self,
        keyword: bytes,
        dtype: type[np.float64] | type[np.int64],
        rewrite: Callable[[bytes], bytes] = bytes,
    ) -> tuple[NDArray[Any], NDArray[np.int64]]:
        """All numbers of all lines of a kind, one after the other, and the words a line."""
        kind = self.kind(keyword)
        sizes = self._words[kind] - 1
        if not sizes.sum():
            return np.empty(0, dtype), sizes
        block = self._codes[np.repeat(kind, self._lengths)]
        first = np.concatenate(([0], np.cumsum(self._lengths[kind])[:-1]))
        for i in range(len(keyword)):
            block[first + i] = _BLANK
        values = _parse(rewrite(block.tobytes()), dtype)
        if values is None:
            self._fail(keyword, kind, dtype, rewrite)
        return values, sizes

    def _fail(
        self,
        keyword: bytes,
        kind: NDArray[np.bool_],
        dtype: type[np.float64] | type[np.int64],
        rewrite: Callable[[bytes], bytes],
    ) -> NoReturn:
        """Raise SceneError for the first line of a kind that does not parse by itself."""
        for line in np.flatnonzero(kind):
            rest = rewrite(self.text(line).encode("latin-1")[len(keyword) :] + b"\n")
            if rest.strip() and _parse(rest, dtype) is None:
                raise SceneError(f"{self.place(line)}; give numbers after '{keyword.decode()}'")
        raise SceneError(f"{keyword.decode()}: not all numbers can be read; write the file anew")

    def text(self, line: int | np.integer) -> str:
        """One line; bytes beyond ASCII as Latin-1."""
        start = self._starts[line]
        return self._codes[start : start + self._lengths[line] - 1].tobytes().decode("latin-1")

    def place(self, line: int | np.integer) -> str:
        """A line's number, from 1, and its text, for a message."""
        text = self.text(line)
        return f"line {line + 1}: '{text if len(text) <= _SHOWN else text[: _SHOWN - 1] + '…'}'"

    def statements(self) -> list[tuple[int, str, str]]:
        """Line, keyword and rest of the lines that name materials and material files."""
        found: list[tuple[int, str, str]] = []
        for keyword in (b"mtllib", b"usemtl"):
            for line in np.flatnonzero(self.kind(keyword)):
                start = self._starts[line] + len(keyword)
                rest = self._codes[start : self._starts[line] + self._lengths[line]].tobytes()
                found.append((int(line), keyword.decode(), rest.decode("utf-8", "replace").strip()))
        return sorted(found)


def _join_continued(match: re.Match[bytes]) -> bytes:
    """Lines that end in a backslash as one line, followed by as many empty ones."""
    count = match[1].count(b"\n")
    return match[1].replace(b"\\\n", b" ") + match[2] + b"\n" * count


def _parse(text: bytes, dtype: type[np.float64] | type[np.int64]) -> NDArray[Any] | None:
    """The numbers in a text, or None where something in it is no number."""
    try:
        return np.fromstring(text, dtype, sep=" ")
    except (ValueError, DeprecationWarning):
        return None


def _positions(
    lines: _Lines, values: NDArray[np.float64], sizes: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
    """x y z [w], or x y z and a colour; w is only for rational curves and ignored."""
    if (sizes < 3).any():
        line = np.flatnonzero(lines.kind(b"v"))[int(np.argmin(sizes))]
        raise SceneError(f"{lines.place(line)}; give three coordinates")
    first = np.cumsum(sizes) - sizes
    positions = values[first[:, None] + np.arange(3)]
    if not len(sizes) or (sizes < 6).any():
        return positions, None
    return positions, values[first[:, None] + np.arange(3, 6)]


def _columns(lines: _Lines, keyword: bytes, least: int, count: int) -> NDArray[np.float64]:
    """The first `count` numbers of each line of a kind, zero where fewer stand."""
    values, sizes = lines.numbers(keyword, np.float64)
    if (sizes < least).any():
        line = np.flatnonzero(lines.kind(keyword))[int(np.argmin(sizes))]
        raise SceneError(f"{lines.place(line)}; give {count} numbers")
    out = np.zeros((len(sizes), count))
    first = np.cumsum(sizes) - sizes
    for column in range(count):
        present = sizes > column
        out[present, column] = values[first[present] + column]
    return out


def _corners(
    lines: _Lines, counts: tuple[int, int, int]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Corners of all faces, [corner, 3] from 0 with −1 for absent, and corners a face."""
    slashes: list[NDArray[np.int64]] = []

    def split(text: bytes) -> bytes:
        # v//vn and v/ have an empty place; 0 is no index in OBJ and so can stand for it.
        text = text.replace(b"//", b"/0/").replace(b"/ ", b"/0 ").replace(b"/\n", b"/0\n")
        slashes[:] = [_slashes_per_word(text)]
        return text.replace(b"/", b" ")

    values, sizes = lines.numbers(b"f", np.int64, split)
    corners = np.zeros((int(sizes.sum()), 3), np.int64)
    if not len(corners):
        return corners, sizes
    per_corner = slashes[0]
    first = np.cumsum(per_corner + 1) - per_corner - 1
    if per_corner.max() > 2 or first[-1] + per_corner[-1] + 1 != len(values):
        _fail_corner(lines)
    face = np.repeat(np.arange(len(sizes)), sizes)
    for column, keyword in enumerate((b"v", b"vt", b"vn")):
        present = per_corner >= column
        corners[present, column] = values[first[present] + column]
        _from_zero(lines, corners[:, column], face, keyword, counts[column])
    return corners, sizes


def _fail_corner(lines: _Lines) -> NoReturn:
    """Raise SceneError for the first face with a corner that is not v, v/vt, v//vn or v/vt/vn."""
    for line in np.flatnonzero(lines.kind(b"f")):
        if not all(_CORNER.fullmatch(word) for word in lines.text(line).split()[1:]):
            raise SceneError(f"{lines.place(line)}; give corners as v, v/vt, v//vn or v/vt/vn")
    raise SceneError("f: not all corners can be read; write the file anew")


def _slashes_per_word(text: bytes) -> NDArray[np.int64]:
    codes = np.frombuffer(text, np.uint8)
    return _count_between(np.flatnonzero(codes == ord("/")), _word_starts(codes))


def _word_starts(codes: NDArray[np.uint8]) -> NDArray[np.int64]:
    """Where words begin in a text of bytes that is cut by spaces and line ends."""
    inside = (codes != _BLANK) & (codes != _NEWLINE)
    inside[1:] &= ~inside[:-1]
    return np.flatnonzero(inside)


def _count_between(places: NDArray[np.int64], starts: NDArray[np.int64]) -> NDArray[np.int64]:
    """How many of the ascending places lie from each start up to the next one."""
    return np.diff(np.searchsorted(places, starts), append=len(places))


def _from_zero(
    lines: _Lines,
    index: NDArray[np.int64],
    face: NDArray[np.int64],
    keyword: bytes,
    count: int,
) -> None:
    """In place: indices from 1, or back from the last vertex so far, to indices from 0."""
    face_lines = np.flatnonzero(lines.kind(b"f"))
    negative = index < 0
    if negative.any():
        so_far = np.cumsum(lines.kind(keyword))[face_lines]
        index[negative] += so_far[face[negative]] + 1
        bad = negative & (index < 1)
    else:
        bad = np.zeros(len(index), bool)
    bad |= index > count
    if keyword == b"v":
        bad |= index == 0
    if bad.any():
        line = face_lines[face[int(np.argmax(bad))]]
        raise SceneError(
            f"{lines.place(line)}; give {keyword.decode()} indices from 1 to {count}, or "
            "negative ones that count back"
        )
    index -= 1

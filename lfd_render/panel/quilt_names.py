"""How files say that they are quilts: their names, PNG text entries, and EXIF.

The name is ``<stem>_qs<columns>x<rows>a<aspect>.<ext>``; aspect is a view's width for its height
as shown. Older files carry JSON in EXIF's UserComment: LKGColumns, LKGRows, LKGAspect.
"""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import NamedTuple

from PIL import ExifTags, Image

from lfd_render.errors import PictureError, UsageError
from lfd_render.panel.picture import PictureFile

STORED_KEYS = ("lfd:quilt-tiles", "lfd:quilt-aspect")
_SAME_ASPECT = 0.01  # names are rounded, often to two places
_CHARSET = b"ASCII\0\0\0"  # EXIF's UserComment begins with the name of its character set
_NAME = re.compile(r"_qs([1-9]\d{0,3})x([1-9]\d{0,3})a(\d{1,4}(?:\.\d{1,9})?)$", re.IGNORECASE)
_PICTURE_SUFFIX = re.compile(r"\.(png|jpe?g|webp|tiff?|bmp)$", re.IGNORECASE)


class QuiltLayout(NamedTuple):
    """Tiles of a quilt, and a view's aspect where it is known."""

    columns: int
    rows: int
    aspect: float | None

    def agrees(self, other: QuiltLayout) -> bool:
        """Whether both say the same, aspects to 1 %."""
        if self[:2] != other[:2]:
            return False
        a, b = self.aspect, other.aspect
        return a is None or b is None or abs(a / b - 1) <= _SAME_ASPECT

    def __str__(self) -> str:
        aspect = "" if self.aspect is None else f" of aspect {self.aspect:.5g}"
        return f"{self.columns} x {self.rows} views{aspect}"


def layout_of(path: Path, file: PictureFile) -> QuiltLayout:
    """The tiling that a file states; raises PictureError where its statements differ."""
    said = {
        "its name": named_layout(path),
        "its metadata": _stored(file.text),
        "its EXIF comment": _commented(file.comment),
    }
    found = {place: layout for place, layout in said.items() if layout}
    if not found:
        raise PictureError(
            f"{path}: says nowhere how it is tiled; name it "
            "<stem>_qs<columns>x<rows>a<aspect>.png, or give --tiles"
        )
    (place, first), *others = found.items()
    for other, layout in others:
        if not first.agrees(layout):
            raise PictureError(
                f"{path}: {place} says {first}, {other} {layout}; correct the name, or give --tiles"
            )
    # The stored aspect has all its digits.
    exact = found.get("its metadata", first)
    return QuiltLayout(first.columns, first.rows, exact.aspect or first.aspect)


def named_layout(path: Path) -> QuiltLayout | None:
    """What a file's name says."""
    match = _NAME.search(_PICTURE_SUFFIX.sub("", path.name))
    return QuiltLayout(int(match[1]), int(match[2]), float(match[3]) or None) if match else None


def named_path(path: str | Path, layout: QuiltLayout) -> Path:
    """A file's name with the tiling in it. Raises UsageError where it names another."""
    path = Path(path)
    named = named_layout(path)
    if named and not named.agrees(layout):
        raise UsageError(f"{path}: names {named}, but the quilt has {layout}")
    if named:
        return path
    stem = path.stem if path.suffix.lower() == ".png" else path.name
    aspect = f"{layout.aspect:.5f}".rstrip("0").rstrip(".")
    return path.with_name(f"{stem}_qs{layout.columns}x{layout.rows}a{aspect}.png")


def stored_text(layout: QuiltLayout) -> dict[str, str]:
    """PNG text entries; they read back to the same bits."""
    return dict(
        zip(STORED_KEYS, (f"{layout.columns}x{layout.rows}", repr(layout.aspect)), strict=True)
    )


def comment_exif(layout: QuiltLayout) -> bytes:
    """A TIFF structure with the UserComment that other programs read."""
    comment = dict(zip(("LKGColumns", "LKGRows", "LKGAspect"), layout, strict=True))
    exif = Image.Exif()
    ifd = exif.get_ifd(ExifTags.IFD.Exif)
    ifd[ExifTags.Base.UserComment] = _CHARSET + json.dumps(comment).encode()
    return exif.tobytes().removeprefix(b"Exif\0\0")


def _stored(text: dict[str, str]) -> QuiltLayout | None:
    tiles, aspect = (text.get(key, "") for key in STORED_KEYS)
    match = re.fullmatch(r"([1-9]\d{0,3})x([1-9]\d{0,3})", tiles)
    if not match:
        return None
    exact = float(aspect) if re.fullmatch(r"\d{1,4}\.\d{1,20}", aspect) else 0.0
    return QuiltLayout(int(match[1]), int(match[2]), exact or None)


def _commented(comment: bytes) -> QuiltLayout | None:
    """What a vendor's JSON says; None where it is something else."""
    found = re.search(rb"\{.*\}", comment, re.DOTALL)
    try:
        data = json.loads(found[0].replace(b"\0", b"")) if found else None
        if not isinstance(data, dict):
            return None
        columns, rows = int(data["LKGColumns"]), int(data["LKGRows"])
        aspect = float(data.get("LKGAspect") or 0.0)
    except (ValueError, KeyError, TypeError, OverflowError, RecursionError):
        return None
    if min(columns, rows) < 1:
        return None
    return QuiltLayout(columns, rows, aspect if 0 < aspect < math.inf else None)

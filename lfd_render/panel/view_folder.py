"""Unwoven views as a folder: view_000.png and on, leftmost first, and views.json about them."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from lfd_render.display import DisplayProfile
from lfd_render.display.model import MAX_VIEWS
from lfd_render.errors import PictureError
from lfd_render.panel.picture import read_picture, write_png
from lfd_render.panel.unweave import Unwoven, unwoven_grid

SCHEMA = "lfd-views/1"
MANIFEST = "views.json"


def view_name(index: int) -> str:
    """File name of a view."""
    return f"view_{index:03d}.png"


def write_views(folder: Path, unwoven: Unwoven, profile: DisplayProfile) -> None:
    """Write views and manifest into an existing folder. Raises OutputError."""
    manifest = {
        "schema": SCHEMA,
        "profile": profile.name,
        "profile_hash": profile.hash,
        "grid": "lens",
        "views": len(unwoven.views),
        "columns": unwoven.grid.columns,
        "rows": unwoven.grid.rows,
        "sampled": unwoven.sampled,
        "collisions": unwoven.collisions,
    }
    text = {"lfd:profile": profile.name, "lfd:profile-hash": profile.hash}
    for index, picture in enumerate(unwoven.views):
        write_png(folder / view_name(index), picture, text | {"lfd:view": str(index)})
    (folder / MANIFEST).write_text(json.dumps(manifest, indent=1) + "\n", encoding="utf-8")


def read_views(folder: str | Path, profile: DisplayProfile) -> Unwoven:
    """The unwoven views of a folder, which weave back into the same panel image.

    Raises PictureError for a folder without them, of another display, or with pictures that are
    missing or of another size.
    """
    path = Path(folder) / MANIFEST
    data = _manifest(path)
    count, rows, columns = data["views"], data["rows"], data["columns"]
    if data["profile_hash"] != profile.hash:
        raise PictureError(
            f"{path}: the views follow the lenses of '{data['profile']}', whose figures are not "
            f"those of '{profile.name}'; give another --display, or weave a quilt"
        )
    if not (1 <= count <= MAX_VIEWS and 1 <= rows <= profile.resolution_px[1]):
        raise PictureError(
            f"{path}: {count} views of {rows} rows; it should be 1 to {MAX_VIEWS} of up to "
            f"{profile.resolution_px[1]}"
        )
    grid = unwoven_grid(profile, count, rows)
    if grid.columns != columns:
        raise PictureError(f"{path}: columns is {columns}; it should be {grid.columns}")
    views = np.empty((count, rows, columns, 3), np.uint8)
    for index in range(count):
        file = Path(folder) / view_name(index)
        picture = read_picture(file)
        if picture.shape != views.shape[1:]:
            raise PictureError(
                f"{file}: {picture.shape[1]} x {picture.shape[0]} pixels; {MANIFEST} says "
                f"{columns} x {rows}"
            )
        views[index] = picture
    return Unwoven(views, grid, float(data["sampled"]), int(data["collisions"]))


_FIELDS: dict[str, tuple[type, ...]] = {
    "profile": (str,),
    "profile_hash": (str,),
    "views": (int,),
    "columns": (int,),
    "rows": (int,),
    "sampled": (int, float),
    "collisions": (int,),
}


def _manifest(path: Path) -> dict[str, Any]:
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except OSError as cause:
        raise PictureError(
            f"{path}: {cause.strerror}; give a quilt, or a folder that 'unweave' wrote"
        ) from cause
    except (ValueError, RecursionError) as cause:
        raise PictureError(f"{path}: is not JSON: {cause}; unweave again") from cause
    if not isinstance(data, dict) or data.get("schema") != SCHEMA:
        raise PictureError(f"{path}: schema is not {SCHEMA}; give a folder that 'unweave' wrote")
    for name, kinds in _FIELDS.items():
        value = data.get(name)
        number = isinstance(value, int | float) and 0 <= value < math.inf
        if (
            not isinstance(value, kinds)
            or isinstance(value, bool)
            or not (number or kinds == (str,))
        ):
            raise PictureError(f"{path}: {name} is {data.get(name)!r}; unweave again")
    return data

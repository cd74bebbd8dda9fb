"""The elemental image array: the panel image with all views woven in."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import DisplayProfile, ViewGrid
from lfd_render.display.model import Mount
from lfd_render.display.mount import seen, stored, stored_size
from lfd_render.errors import OutputError, PictureError
from lfd_render.panel.formats import FORMATS, format_of, write_exr, write_raw
from lfd_render.panel.picture import read_picture_file, write_png
from lfd_render.version import __version__


@dataclass(frozen=True, eq=False)
class Eia:
    """A panel image. pixels: uint8 [y, x, 3], sRGB; linear: float16 [y, x, 3], scene-linear light
    before exposure and tone curve, None where it was not asked for; report: what was rendered, how,
    and how long it took; metadata: what its files carry, by keyword; mount: how the panel takes it,
    which its files follow."""

    pixels: NDArray[np.uint8]
    linear: NDArray[np.float16] | None
    report: dict[str, Any] = field(default_factory=dict)
    metadata: dict[str, str] = field(default_factory=dict)
    mount: Mount | None = None

    def save(self, path: str | Path, format: str | None = None) -> None:
        """Write a PNG or raw bytes of `pixels`, or an EXR of `linear`, with the metadata.

        format: ``png``, ``exr`` or ``raw``; None: what the name ends in. A raw file's metadata
        stands beside it in ``<path>.json``. Raises OutputError for another format, and when the
        file cannot be written; no partial file is left.
        """
        if format is not None and format not in FORMATS:
            raise OutputError(f"{path}: format '{format}': unknown; use {', '.join(FORMATS)}")
        match format or format_of(path):
            case "png":
                write_png(path, stored(self.pixels, self.mount), self.metadata)
            case "exr":
                if self.linear is None:
                    raise OutputError(
                        f"{path}: the panel image holds no linear light, as .exr does; give .png "
                        "or .raw"
                    )
                write_exr(path, stored(self.linear, self.mount), self.metadata)
            case "raw":
                write_raw(path, stored(self.pixels, self.mount), self.metadata)


def eia_metadata(
    display: DisplayProfile, views: int, grid: ViewGrid, **choices: object
) -> dict[str, str]:
    """What the files of a panel image say about it; `choices` under their own names, with ``lfd:``
    before them and dashes for underscores."""
    named = {f"lfd:{name.replace('_', '-')}": str(value) for name, value in choices.items()}
    return {
        "Software": f"lfd_render {__version__}",
        "lfd:profile": display.name,
        "lfd:profile-hash": display.hash,
        "lfd:views": str(views),
        "lfd:view-grid": grid.kind,
        "lfd:view-size": f"{grid.columns}x{grid.rows}",
        **named,
    }


@dataclass(frozen=True, eq=False)
class EiaFile:
    """A panel image read from a file. warnings: what a person should know before trusting it."""

    pixels: NDArray[np.uint8]  # [y, x, 3], as the viewer sees it
    metadata: dict[str, str]
    warnings: tuple[str, ...]

    @property
    def views(self) -> int | None:
        """Number of views woven in, where the file says it."""
        text = self.metadata.get("lfd:views", "")
        return int(text) if re.fullmatch(r"[1-9]\d{0,3}", text) else None

    @property
    def eye_views(self) -> int | None:
        """Number of views that the rows of an eye's picture go by, where the file says it."""
        text = self.metadata.get("lfd:eye-views", "")
        return int(text) if re.fullmatch(r"[1-9]\d{0,3}", text) else self.views

    @property
    def lens_rows(self) -> int | None:
        """Rows of the views woven in, where the file says that these follow the lenses."""
        size = re.fullmatch(r"\d{1,6}x([1-9]\d{0,5})", self.metadata.get("lfd:view-size", ""))
        return int(size[1]) if size and self.metadata.get("lfd:view-grid") == "lens" else None


def read_eia(path: str | Path, display: DisplayProfile) -> EiaFile:
    """The panel image of a file, with warnings where it was made for other figures than the
    display's, or stored with loss.

    Raises PictureError for a file that is no picture, or none of the display's size.
    """
    file = read_picture_file(path)
    mount = display.panel.mount
    width, height = stored_size(display.resolution_px, mount)
    found_height, found_width = file.pixels.shape[:2]
    made_for = file.text.get("lfd:profile", "an unnamed display")
    if (found_width, found_height) != (width, height):
        raise PictureError(
            f"{path}: {found_width} x {found_height} pixels, made for {made_for}; "
            f"the display '{display.name}' takes {width} x {height}, give another --display"
        )
    warnings = []
    if file.text.get("lfd:profile-hash", display.hash) != display.hash:
        warnings.append(f"{path}: made for {made_for}, whose figures differ from '{display.name}'")
    if file.kind == "JPEG":
        warnings.append(
            f"{path}: is a JPEG, whose chroma subsampling mixes the views of neighbouring pixels; "
            "a panel image should be kept as PNG"
        )
    return EiaFile(seen(file.pixels, mount), file.text, tuple(warnings))

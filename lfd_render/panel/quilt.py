"""Quilts: all views tiled in one picture, view 0 bottom-left, rows going up.

Tiles start at the bottom left; where a preset's size is no multiple of its tiles, the rest is
black, on the right and on top. A view's pixels need not be square, so a quilt knows its aspect.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import DisplayProfile
from lfd_render.errors import PictureError, UsageError
from lfd_render.panel.picture import read_picture_file, write_png
from lfd_render.panel.quilt_names import (
    STORED_KEYS,
    QuiltLayout,
    comment_exif,
    layout_of,
    named_path,
    stored_text,
)

MAX_TILES = 1024  # as many views as a renderer makes
_STRETCHED = 0.02  # more than this shows
_MOST_STRETCH = 2.0  # of view pixels, beyond the 1.78 of vendors' presets


class QuiltSize(NamedTuple):
    """Tiles and pixels of a quilt."""

    columns: int
    rows: int
    width_px: int
    height_px: int

    @property
    def views(self) -> int:
        """Number of tiles."""
        return self.columns * self.rows

    @property
    def view_px(self) -> tuple[int, int]:
        """Width and height of a view."""
        return self.width_px // self.columns, self.height_px // self.rows


# By device, Looking Glass's own.
PRESETS = {
    "portrait": QuiltSize(8, 6, 3360, 3360),
    "go": QuiltSize(11, 6, 4092, 4092),
    "16-gen2": QuiltSize(5, 9, 4096, 4096),
    "16-landscape": QuiltSize(7, 7, 5999, 5999),
    "16-portrait": QuiltSize(11, 6, 5995, 6000),
    "27-landscape": QuiltSize(8, 6, 7680, 4320),
    "27-portrait": QuiltSize(12, 4, 7680, 4320),
    "32-landscape": QuiltSize(7, 7, 8190, 8190),
    "32-portrait": QuiltSize(11, 6, 8184, 8184),
    "65": QuiltSize(8, 9, 8192, 8192),
}


@dataclass(frozen=True, eq=False)
class Quilt:
    """Views uint8 [view, y, x, 3], view 0 leftmost, in columns × rows tiles.

    aspect: width of a view for its height, as shown; 0: that of its pixels. size_px: width and
    height of the picture, by default those of the tiles. metadata: what its file carries besides.
    warnings: what a person should know of its file.
    Raises UsageError for numbers that fit no quilt.
    """

    views: NDArray[np.uint8]
    columns: int
    rows: int
    aspect: float = 0.0
    size_px: tuple[int, int] = (0, 0)
    metadata: dict[str, str] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check, and fill in what was left out."""
        views = self.views
        if views.dtype != np.uint8 or views.ndim != 4 or views.shape[3] != 3 or not views.size:
            raise UsageError(
                f"quilt: views are {views.dtype} {list(views.shape)}; they should be uint8 "
                "[view, y, x, 3]"
            )
        if min(self.columns, self.rows) < 1 or len(views) != self.columns * self.rows:
            raise UsageError(
                f"quilt: {len(views)} views do not fill {self.columns} x {self.rows} tiles"
            )
        height, width = views.shape[1:3]
        if not self.aspect:
            object.__setattr__(self, "aspect", width / height)
        if not 0.01 <= self.aspect <= 100:
            raise UsageError(f"quilt: aspect is {self.aspect}; it should be from 0.01 to 100")
        if self.size_px == (0, 0):
            object.__setattr__(self, "size_px", (width * self.columns, height * self.rows))
        if QuiltSize(self.columns, self.rows, *self.size_px).view_px != (width, height):
            raise UsageError(
                f"quilt: {self.size_px[0]} x {self.size_px[1]} pixels do not hold "
                f"{self.columns} x {self.rows} views of {width} x {height}"
            )

    @property
    def layout(self) -> QuiltLayout:
        """Tiles and aspect."""
        return QuiltLayout(self.columns, self.rows, self.aspect)

    @property
    def pixels(self) -> NDArray[np.uint8]:
        """The picture, uint8 [y, x, 3], top row first."""
        _, height, width, _ = self.views.shape
        tiles = self.views.reshape(self.rows, self.columns, height, width, 3)[::-1]
        picture = np.zeros((self.size_px[1], self.size_px[0], 3), np.uint8)
        tiled = tiles.transpose(0, 2, 1, 3, 4).reshape(self.rows * height, self.columns * width, 3)
        picture[self.size_px[1] - self.rows * height :, : self.columns * width] = tiled
        return picture

    def misfits(self, display: DisplayProfile, source: str = "quilt") -> list[str]:
        """What does not suit a display, one sentence each: views of another aspect."""
        wanted = display.size_mm[0] / display.size_mm[1]
        if abs(self.aspect / wanted - 1) <= _STRETCHED:
            return []
        return [
            f"{source}: its views have aspect {self.aspect:.4g}, the display '{display.name}' "
            f"{wanted:.4g}; they are stretched"
        ]

    @staticmethod
    def from_pixels(
        pixels: NDArray[np.uint8], columns: int, rows: int, aspect: float = 0.0
    ) -> Quilt:
        """The quilt whose picture this is, uint8 [y, x, 3]; the reverse of `pixels`."""
        size = QuiltSize(columns, rows, pixels.shape[1], pixels.shape[0])
        width, height = size.view_px
        tiles = pixels[size.height_px - rows * height :, : columns * width]
        views = tiles.reshape(rows, height, columns, width, 3)[::-1].transpose(0, 2, 1, 3, 4)
        flat = np.ascontiguousarray(views).reshape(size.views, height, width, 3)
        return Quilt(flat, columns, rows, aspect, (size.width_px, size.height_px))

    def path(self, path: str | Path) -> Path:
        """The file's name with the tiling in it. Raises UsageError where it names another."""
        return named_path(path, self.layout)

    def save(self, path: str | Path) -> Path:
        """Write a PNG under the convention's name, and give that name back.

        The tiling is in its metadata and in EXIF's UserComment too. Raises UsageError where the
        name says another tiling, OutputError where the file cannot be written.
        """
        path = self.path(path)
        self.write(path)
        return path

    def write(self, path: str | Path) -> None:
        """Write the PNG under this very name. Raises OutputError."""
        text = self.metadata | stored_text(self.layout)
        write_png(path, self.pixels, text, comment_exif(self.layout))

    @staticmethod
    def load(path: str | Path, tiles: tuple[int, int] | None = None) -> Quilt:
        """The quilt of a file, by its name, its metadata or its EXIF comment; by `tiles` (columns,
        rows) whatever these say.

        Raises PictureError for a file that is no picture, that says nowhere how it is tiled, or
        whose name, metadata and pixels disagree.
        """
        path = Path(path)
        file = read_picture_file(path)
        layout = QuiltLayout(*tiles, None) if tiles else layout_of(path, file)
        height, width = file.pixels.shape[:2]
        size = QuiltSize(layout.columns, layout.rows, width, height)
        _check_size(path, size, layout, own=STORED_KEYS[0] in file.text or bool(tiles))
        quilt = Quilt.from_pixels(file.pixels, size.columns, size.rows, layout.aspect or 0.0)
        warnings = (
            (f"{path}: is a JPEG, whose chroma subsampling blurs colours; a PNG weaves sharper",)
            if file.kind == "JPEG"
            else ()
        )
        text = {key: value for key, value in file.text.items() if key not in STORED_KEYS}
        return Quilt(
            quilt.views, quilt.columns, quilt.rows, quilt.aspect, quilt.size_px, text, warnings
        )


def _check_size(path: Path, size: QuiltSize, layout: QuiltLayout, *, own: bool) -> None:
    """Raise PictureError for pixels that cannot be this quilt. own: whether the pixels' stretch is
    known to be meant."""
    pixels = f"{size.width_px} x {size.height_px} pixels"
    if size.views > MAX_TILES or min(size.view_px) < 1:
        raise PictureError(f"{path}: {pixels} cannot hold {layout}; at most {MAX_TILES} are read")
    if (size.width_px % size.columns or size.height_px % size.rows) and (
        size not in PRESETS.values()
    ):
        raise PictureError(
            f"{path}: {pixels} do not divide into {size.columns} x {size.rows} views; correct the "
            "name or --tiles"
        )
    width, height = size.view_px
    stretch = width / height / layout.aspect if layout.aspect else 1.0
    if not own and not 1 / _MOST_STRETCH <= stretch <= _MOST_STRETCH:
        raise PictureError(
            f"{path}: {pixels} make views of {width} x {height}, but its name says "
            f"{layout}; correct the name or give --tiles"
        )

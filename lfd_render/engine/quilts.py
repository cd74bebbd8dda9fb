"""How many tiles of what size a quilt has."""

from __future__ import annotations

from lfd_render.display import DisplayProfile
from lfd_render.errors import OptionError
from lfd_render.panel.quilt import MAX_TILES, PRESETS, QuiltSize
from lfd_render.renderer import upright_size


def chosen_size(
    profile: DisplayProfile,
    device: str | None,
    tiles: tuple[int, int] | None,
    pixels: tuple[int, int] | None,
) -> QuiltSize:
    """Tiles and pixels as asked for, else as the display's own views ask. Raises OptionError."""
    if device is not None:
        if tiles or pixels:
            raise OptionError("quilt", "names tiles and size; leave tiles and size out")
        if device not in PRESETS:
            raise OptionError("quilt", f"'{device}' is not known; give {', '.join(PRESETS)}")
        return PRESETS[device]
    columns, rows = tiles or _nearly_square(profile.views)
    if columns * rows > MAX_TILES:
        raise OptionError("tiles", f"{columns} x {rows} are too many; give at most {MAX_TILES}")
    if pixels is None:
        width, height = upright_size(profile, columns * rows)
        return QuiltSize(columns, rows, columns * width, rows * height)
    if pixels[0] % columns or pixels[1] % rows:
        raise OptionError(
            "size",
            f"{pixels[0]}x{pixels[1]} does not divide into {columns}x{rows} tiles; give "
            "multiples of them",
        )
    return QuiltSize(columns, rows, *pixels)


def _nearly_square(views: int) -> tuple[int, int]:
    """Columns and rows of so many tiles, columns the more."""
    rows = max(n for n in range(1, int(views**0.5) + 1) if views % n == 0)
    return views // rows, rows

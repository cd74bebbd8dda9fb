"""The virtual panel: what an eye in front of the display sees of an elemental image array.

Crosstalk-free. Behind each lens, on each row of the view, the eye sees for every colour the
subpixel whose place under the lens is nearest to the one in line with the eye. The lens-aligned
result is resampled to an upright picture.
"""

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import DisplayProfile, ViewGrid, slot_from_angle
from lfd_render.display.model import MAX_VIEWS
from lfd_render.errors import PictureError, UsageError

Pixels = NDArray[np.uint8]
Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]
Index = NDArray[np.int64]

# Encoded 8-bit value → scene-linear light (IEC 61966-2-1).
_CODES = np.arange(256) / 255
_LINEAR = np.where(_CODES <= 0.04045, _CODES / 12.92, ((_CODES + 0.055) / 1.055) ** 2.4)
_LINEAR_FROM_CODE = _LINEAR.astype(np.float32)


def look(
    eia: Pixels,
    profile: DisplayProfile,
    angle_rad: float,
    views: int | None = None,
    size_px: tuple[int, int] | None = None,
) -> Pixels:
    """Picture seen from (D·tan θ, 0, D) of a panel image, uint8 [y, x, 3].

    θ is positive to the viewer's right, |θ| < 90°; beyond half the cone the views repeat, as
    they do on the display. `views` (the profile's by default) sets how many rows the picture
    has, those of the views woven into the image; columns follow for square pixels. `size_px`
    (width, height) asks for another size. Colours are interpolated in linear light. Raises
    PictureError for an image that is not the panel's size.
    """
    width, height = profile.resolution_px
    if eia.dtype != np.uint8 or eia.shape != (height, width, 3):
        raise PictureError(
            f"panel image is {eia.dtype} {list(eia.shape)}; the display '{profile.name}' takes "
            f"uint8 [{height}, {width}, 3]"
        )
    count = profile.views if views is None else views
    if not 1 <= count <= MAX_VIEWS:
        raise UsageError(f"views is {count}; it should be from 1 to {MAX_VIEWS}")
    grid = ViewGrid.lens(profile, ViewGrid.default_rows(profile, count))
    columns = max(1, round(grid.rows * profile.size_mm[0] / profile.size_mm[1]))
    out_columns, out_rows = size_px or (columns, grid.rows)
    if min(out_columns, out_rows) < 1:
        raise UsageError(f"view size is {out_columns} x {out_rows}; it should be at least 1 x 1")

    x, y, miss = nearest_subpixels(profile, grid, 0.5 + slot_from_angle(angle_rad, profile))
    seen = _LINEAR_FROM_CODE[eia[y, x, np.arange(3)]]
    # A lens cut off by the panel's edge may have no subpixel within a view of the eye's.
    upright = _upright(seen, miss * count <= 1, grid, out_columns)
    if out_rows != grid.rows:
        upright = _resample_rows(upright, out_rows)
    return _code_from_linear(upright)


def nearest_subpixels(
    profile: DisplayProfile, grid: ViewGrid, z: float
) -> tuple[Index, Index, Float64]:
    """Subpixel under each lens nearest to the place z (0..1, leftmost view at 0).

    For each view row, lens column and colour of a lens-aligned grid: panel column x and row y,
    both [row, lens, channel], and the distance in lenses, infinite where the lens has none.
    """
    tables = profile.phase_tables()
    width, height = tables.size_px
    lens = (grid.row_base[:, None] + np.arange(grid.columns))[..., None]  # [row, lens, 1]
    wanted = lens + (1.0 - z) % 1.0
    first = grid.first_panel_rows(height)
    step = profile.lens_count / width
    reach = 1 + int(np.ceil(np.abs(tables.cell).max() / step))

    shape = (grid.rows, grid.columns, 3)
    best_x, best_y = np.zeros(shape, np.int64), np.zeros(shape, np.int64)
    best = np.full(shape, np.inf)
    for nth in range(int(np.diff(first).max())):
        y = np.minimum(first[:-1] + nth, first[1:] - 1)[:, None, None]
        near = np.rint((wanted - tables.row[y] - tables.column[0]) / step).astype(np.int64)
        for shift in range(-reach, reach + 1):
            x = np.clip(near + shift, 0, width - 1)
            phase = tables.phase_at(x, y)
            miss = np.where(np.floor(phase) == lens, np.abs(phase - wanted), np.inf)
            better = miss < best
            best_x = np.where(better, x, best_x)
            best_y = np.where(better, y, best_y)
            best = np.where(better, miss, best)
    return best_x, best_y, best


def _upright(seen: Float32, valid: NDArray[np.bool_], grid: ViewGrid, columns: int) -> Float32:
    """Lens-aligned [row, lens, channel] → upright [row, x, channel], linear along each row.

    Beyond the first and last valid lens of a row the picture continues with that lens.
    """
    first = np.argmax(valid, axis=1)[:, None, :]
    last = grid.columns - 1 - np.argmax(valid[:, ::-1], axis=1)[:, None, :]
    x_mm = ((np.arange(columns) + 0.5) / columns - 0.5) * grid.panel_mm[0]
    at = x_mm / grid.column_mm + grid.row_offset[:, None] - 0.5  # [row, x], lens centres whole
    left = np.floor(at).astype(np.int64)
    weight = (at - left)[..., None].astype(np.float32)
    low, high = (
        np.take_along_axis(seen, np.clip(lens[..., None], first, last), axis=1)
        for lens in (left, left + 1)
    )
    return low + (high - low) * weight


def _resample_rows(picture: Float32, rows: int) -> Float32:
    """Linear interpolation between row centres, [y, x, channel]."""
    count = len(picture)
    at = np.clip((np.arange(rows) + 0.5) * count / rows - 0.5, 0, count - 1)
    above = np.floor(at).astype(np.int64)
    weight = (at - above)[:, None, None].astype(np.float32)
    low, high = picture[above], picture[np.minimum(above + 1, count - 1)]
    return np.asarray(low + (high - low) * weight)


def _code_from_linear(linear: Float32) -> Pixels:
    """Scene-linear light → sRGB codes, rounded to nearest."""
    code = np.where(
        linear <= 0.0031308,
        12.92 * linear,
        1.055 * np.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055,
    )
    codes: Pixels = np.rint(np.clip(code, 0, 1) * 255).astype(np.uint8)
    return codes

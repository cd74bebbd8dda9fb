"""The virtual panel: what an eye in front of the display sees of an elemental image array.

Behind each lens, on each row of the view, the eye sees the subpixels whose place under the lens is
in line with it: without crosstalk for every colour the nearest one alone, else all of them weighted
by the lens's angular response. The lens-aligned result is resampled to an upright picture.

Which place an eye at (X, Y, Z) sees through the lens at (x, y) follows from the eye-shift formula,
Δφ = s·t/(n·D·p_h) for a shift s at the distance D. Light from the lens to the eye crosses the plane
of the views at

    s = x + (X − x)·D/Z + (y + (Y − y)·D/Z)·tan α

where the last term is the lens's tilt: an eye that moves along the lens axis sees the same view. At
the viewing distance that is X + Y·tan α for all lenses; nearer or farther it changes across the
panel. `optics` says what place the lens shows there:

- ``rig``: the one whose view is rendered from s, which makes the display show what it is sent;
- ``slab``: the one to which Snell's law leads through a flat sheet, less where it leads from the
  middle of the viewing distance: the exact form, with the vertical angle in it.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import DisplayProfile, ViewGrid, slot_from_eye
from lfd_render.display.model import MAX_VIEWS
from lfd_render.display.rig import check_angle
from lfd_render.errors import PictureError, ResourceError, UsageError

Pixels = NDArray[np.uint8]
Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]
Index = NDArray[np.int64]
Eye = tuple[float, float, float]
Optics = Literal["rig", "slab"]

OPTICS = ("rig", "slab")
CUT_SIGMAS = 3.0  # where a Gaussian response ends
MOST_SEEN_PIXELS = 1 << 24  # of an eye's picture: twice a 4K panel's

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
    *,
    sigma_views: float | tuple[float, float, float] | None = None,
    optics: Optics = "rig",
) -> Pixels:
    """Picture seen from (D·tan θ, 0, D) of a panel image, uint8 [y, x, 3].

    θ is positive to the viewer's right, |θ| < 90°; beyond half the cone the views repeat, as
    they do on the display. Otherwise as `look_from`.
    """
    check_angle(angle_rad)
    eye = (profile.distance_mm * math.tan(angle_rad), 0.0, profile.distance_mm)
    return look_from(eia, profile, eye, views, size_px, sigma_views=sigma_views, optics=optics)


def seen_size(profile: DisplayProfile, views: int) -> tuple[int, int]:
    """Width and height of an eye's picture: as many rows as so many views have, square pixels."""
    rows = ViewGrid.default_rows(profile, views)
    return max(1, round(rows * profile.size_mm[0] / profile.size_mm[1])), rows


def look_from(
    eia: Pixels,
    profile: DisplayProfile,
    eye_mm: Eye,
    views: int | None = None,
    size_px: tuple[int, int] | None = None,
    *,
    sigma_views: float | tuple[float, float, float] | None = None,
    optics: Optics = "rig",
) -> Pixels:
    """Picture of the panel's window seen from an eye in front of it, uint8 [y, x, 3].

    eye_mm: (x, y, z) in display space. `views` (the profile's by default) sets how many rows the
    picture has, those of the views woven into the image; columns follow for square pixels.
    `size_px` (width, height) asks for another size. Colours are interpolated in linear light.
    sigma_views: standard deviation of the lens's angular response, in the profile's views, of all
    colours or each; the profile's own by default, 0 for no crosstalk. Raises PictureError for an
    image that is not the panel's size, UsageError for what is out of range.
    """
    width, height = profile.resolution_px
    if eia.dtype != np.uint8 or eia.shape != (height, width, 3):
        raise PictureError(
            f"panel image is {eia.dtype} {list(eia.shape)}; the display '{profile.name}' takes "
            f"uint8 [{height}, {width}, 3]"
        )
    check_eye(eye_mm)
    if optics not in OPTICS:
        raise UsageError(f"optics '{optics}': unknown; use {' or '.join(OPTICS)}")
    sigmas = _sigmas(profile, sigma_views)
    count = profile.views if views is None else views
    if not 1 <= count <= MAX_VIEWS:
        raise UsageError(f"views is {count}; it should be from 1 to {MAX_VIEWS}")
    grid = ViewGrid.lens(profile, ViewGrid.default_rows(profile, count))
    columns, _ = seen_size(profile, count)
    out_columns, out_rows = size_px or (columns, grid.rows)
    if min(out_columns, out_rows) < 1:
        raise UsageError(f"view size is {out_columns} x {out_rows}; it should be at least 1 x 1")
    if out_columns * out_rows > MOST_SEEN_PIXELS:
        raise ResourceError(
            f"view size: {out_columns} x {out_rows} are more than {MOST_SEEN_PIXELS} pixels; "
            "the panel shows far fewer, use a smaller one"
        )

    wanted = seen_phases(profile, grid, eye_mm, optics)
    x, y, miss = nearest_subpixels(profile, grid, wanted)
    seen = _LINEAR_FROM_CODE[eia[y, x, np.arange(3)]]
    for channel in np.flatnonzero(np.array(sigmas) > 0):
        seen[..., channel] = _blurred(
            _LINEAR_FROM_CODE[eia[..., channel]], profile, grid, wanted, channel=int(channel),
            sigma=sigmas[channel], nearest=seen[..., channel],
        )  # fmt: skip
    # A lens cut off by the panel's edge may have no subpixel within a view of the eye's.
    upright = _upright(seen, miss * count <= 1, grid, out_columns)
    if out_rows != grid.rows:
        upright = _resample_rows(upright, out_rows)
    return _code_from_linear(upright)


def check_eye(eye_mm: Eye) -> None:
    """Raise UsageError for an eye that cannot see the panel."""
    if len(eye_mm) != 3 or not all(math.isfinite(value) for value in eye_mm):
        raise UsageError(f"eye: {eye_mm}; give three finite numbers, x, y and z in mm")
    if not eye_mm[2] > 0:
        raise UsageError(
            f"eye: z is {eye_mm[2]:g} mm, behind the panel or in it; give a z above 0, as the "
            "display's viewing distance"
        )


def _sigmas(
    profile: DisplayProfile, given: float | tuple[float, float, float] | None
) -> tuple[float, float, float]:
    chosen = profile.response.sigma_views if given is None else given
    red, green, blue = (chosen,) * 3 if isinstance(chosen, int | float) else chosen
    for value in (red, green, blue):
        if not 0 <= value <= MAX_VIEWS:
            raise UsageError(f"crosstalk is {value} views; it should be from 0 to {MAX_VIEWS}")
    return red, green, blue


def seen_phases(
    profile: DisplayProfile, grid: ViewGrid, eye_mm: Eye, optics: Optics = "rig"
) -> Float64:
    """Phase that an eye sees through each lens of a lens-aligned grid, float64 [row, lens].

    At ⌊φ⌋ = the lens it lies under the lens itself, beyond the cone under a neighbour.
    """
    lens = grid.row_base[:, None] + np.arange(grid.columns)
    x = (np.arange(grid.columns) + 0.5 - grid.row_offset[:, None]) * grid.column_mm
    y = np.broadcast_to(grid.row_mm()[:, None], x.shape)
    slot = seen_slot(profile, x, y, eye_mm, optics)
    return np.asarray(lens + 0.5 + (slot if profile.viewing.inverted else -slot))


def seen_slot(
    profile: DisplayProfile, x: Float64, y: Float64, eye_mm: Eye, optics: Optics = "rig"
) -> Float64:
    """Place, −½ to ½ within the cone, that an eye sees through lenses at (x, y) mm."""
    distance, lean = profile.distance_mm, math.tan(profile.tilt_rad)
    if optics == "rig":
        nearer = distance / eye_mm[2]
        across = x + (eye_mm[0] - x) * nearer
        up = y + (eye_mm[1] - y) * nearer
        return slot_from_eye(across + lean * up, profile)
    gap = 0.5 / math.tan(math.asin(math.sin(profile.cone_rad / 2) / profile.index))  # in lenses
    to_eye = _behind(profile.index, eye_mm[0] - x, eye_mm[1] - y, eye_mm[2])
    to_middle = _behind(profile.index, -x, -y, distance)
    return gap * (to_eye[0] - to_middle[0] + lean * (to_eye[1] - to_middle[1]))


def _behind(index: float, x: Float64, y: Float64, z: float) -> tuple[Float64, Float64]:
    """Slopes (x/z, y/z) of light to (x, y, z), inside the sheet (Snell's law)."""
    squared = x * x + y * y
    # tan θ' = sin θ/√(n² − sin² θ), and sin θ = ρ/√(ρ² + z²): the same factor for both slopes.
    scale = 1.0 / np.sqrt(index * index * (squared + z * z) - squared)
    return x * scale, y * scale


def nearest_subpixels(
    profile: DisplayProfile, grid: ViewGrid, wanted: Float64
) -> tuple[Index, Index, Float64]:
    """Subpixel under each lens nearest to a phase wanted there, [row, lens].

    For each view row, lens column and colour of a lens-aligned grid: panel column x and row y,
    both [row, lens, channel], and the distance in lenses, infinite where the lens has none.
    """
    tables = profile.phase_tables()
    width, height = tables.size_px
    aim = wanted[..., None]
    lens = np.floor(aim)
    first = grid.first_panel_rows(height)
    step = profile.lens_count / width
    reach = 1 + int(np.ceil(tables.reach / step))

    shape = (grid.rows, grid.columns, 3)
    best_x, best_y = np.zeros(shape, np.int64), np.zeros(shape, np.int64)
    best = np.full(shape, np.inf)
    for nth in range(int(np.diff(first).max())):
        y = np.minimum(first[:-1] + nth, first[1:] - 1)[:, None, None]
        near = np.rint((aim - tables.row[y] - tables.column[0]) / step).astype(np.int64)
        for shift in range(-reach, reach + 1):
            x = np.clip(near + shift, 0, width - 1)
            phase = tables.phase_at(x, y)
            miss = np.where(np.floor(phase) == lens, np.abs(phase - aim), np.inf)
            better = miss < best
            best_x = np.where(better, x, best_x)
            best_y = np.where(better, y, best_y)
            best = np.where(better, miss, best)
    return best_x, best_y, best


def _blurred(
    light: Float32,
    profile: DisplayProfile,
    grid: ViewGrid,
    wanted: Float64,
    *,
    channel: int,
    sigma: float,
    nearest: Float32,
) -> Float32:
    """Light of one colour [row, lens] through a Gaussian of σ views about the phase wanted.

    light: [y, x] of the panel. nearest: what stands where nothing is within the Gaussian.
    """
    tables = profile.phase_tables()
    width, height = tables.size_px
    first = grid.first_panel_rows(height)
    step = profile.lens_count / width
    spread = sigma / profile.views
    reach = 1 + math.ceil((CUT_SIGMAS * spread + tables.reach) / step)
    total, weights = np.zeros(wanted.shape), np.zeros(wanted.shape)
    for nth in range(int(np.diff(first).max())):
        present = (first[:-1] + nth < first[1:])[:, None]
        y = np.minimum(first[:-1] + nth, first[1:] - 1)[:, None]
        start = tables.row[y] + tables.column[0, channel]
        near = np.rint((wanted - start) / step).astype(np.int64)
        for shift in range(-reach, reach + 1):
            x = near + shift
            inside = present & (x >= 0) & (x < width)
            x = np.clip(x, 0, width - 1)
            kind = 0 if len(tables.cell) == 1 else tables.kind_at(x, y)
            phase = tables.column[x, channel] + tables.row[y] + tables.cell[kind, channel]
            if tables.correction is not None:
                phase += tables.correction_at(x, y)
            sigmas = np.minimum(np.abs(phase - wanted) / spread, 2.0 * CUT_SIGMAS)
            weight = np.where(inside & (sigmas <= CUT_SIGMAS), np.exp(-0.5 * sigmas**2), 0)
            total += weight * light[y, x]
            weights += weight
    found = total / np.maximum(weights, 1e-30)
    return np.where(weights > 1e-6, found, nearest).astype(np.float32)


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

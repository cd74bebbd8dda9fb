"""A display's layout as a picture: which view each subpixel of a patch shows, and where eyes stand.

Left: a patch at the panel's middle. Each subpixel is a box in its view's colour with the view's
number, on a bar in its own colour; lens edges are lines. Right: panel, eyes and cone from above.
"""

from __future__ import annotations

import colorsys
import math

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from lfd_render.display import DisplayProfile
from lfd_render.display.model import Cells

PATCH_PX = (14, 9)
_PIXEL, _MARGIN, _HEAD, _RIG = 72, 24, 64, 420
_INK, _PAPER, _FAINT = (24, 24, 24), (250, 250, 250), (150, 150, 150)


def layout_picture(profile: DisplayProfile, views: int | None = None) -> NDArray[np.uint8]:
    """The picture, uint8 [y, x, 3]."""
    count = profile.views if views is None else views
    columns, rows = (min(a, b) for a, b in zip(PATCH_PX, profile.resolution_px, strict=True))
    patch = columns * _PIXEL, rows * _PIXEL
    size = patch[0] + _RIG + 3 * _MARGIN, max(patch[1], 420) + _HEAD + 2 * _MARGIN
    image = Image.new("RGB", size, _PAPER)
    draw = ImageDraw.Draw(image)
    lean = "left" if profile.drift > 0 else "right"
    tilt = abs(math.degrees(profile.tilt_rad))
    lines = (
        f"{profile.name}   {profile.resolution_px[0]} x {profile.resolution_px[1]} px, "
        f"{profile.size_mm[0]:.1f} x {profile.size_mm[1]:.1f} mm",
        f"{profile.lens_count:.4f} lenses; going up they lean "
        + (f"{tilt:.3f} degrees to the {lean}" if profile.drift else "nowhere")
        + f"; {count} views, 0 leftmost"
        + ("; inverted" if profile.viewing.inverted else ""),
    )
    for n, line in enumerate(lines):
        draw.text((_MARGIN, 12 + 22 * n), line, fill=_INK, font_size=15)
    _draw_patch(draw, profile, count, (columns, rows))
    _draw_rig(draw, profile, count, (patch[0] + 2 * _MARGIN, _HEAD + _MARGIN))
    return np.asarray(image)


def _draw_patch(
    draw: ImageDraw.ImageDraw, profile: DisplayProfile, count: int, size: tuple[int, int]
) -> None:
    """Subpixels where they stand; the text is the view."""
    width, height = profile.resolution_px
    columns, rows = size
    first_x, first_y = (width - columns) // 2, (height - rows) // 2
    x, y = np.arange(first_x, first_x + columns), np.arange(first_y, first_y + rows)
    tables = profile.phase_tables()
    fixed = tables.fixed(count)
    view = fixed.view(tables.fixed_phase(fixed, x, y))
    kinds = tables.kind_at(x[None, :], y[:, None])
    for row, column, channel in np.ndindex(rows, columns, 3):
        right, up = _offset(profile, int(kinds[row, column]), channel)
        box = _box(profile, right, up)
        left, top = _MARGIN + (column + box[0]) * _PIXEL, _HEAD + _MARGIN + (row + box[1]) * _PIXEL
        end = left + box[2] * _PIXEL - 1, top + box[3] * _PIXEL - 1
        number = int(view[row, column, channel])
        colour = _colour(number / count)
        draw.rectangle((left, top, *end), fill=colour, outline=_PAPER)
        draw.rectangle((left + 2, end[1] - 6, end[0] - 2, end[1] - 2), fill=_CHANNELS[channel])
        middle = (left + end[0]) / 2, (top + end[1]) / 2
        draw.text(middle, str(number), fill=_INK, anchor="mm", font_size=11)
    _draw_lens_edges(draw, profile, (first_x, first_y), size)


_CHANNELS = ((214, 40, 40), (30, 150, 60), (40, 80, 220))


def _offset(profile: DisplayProfile, kind: int, channel: int) -> tuple[float, float]:
    """Place of a subpixel in its pixel, from the middle, (right, up), in pixels."""
    subpixels = profile.panel.subpixels
    if isinstance(subpixels, Cells):
        return subpixels.offsets_px[kind][channel]
    along = (subpixels.order.index("rgb"[channel]) - 1) / 3
    return (along, 0.0) if subpixels.axis == "right" else (0.0, along)


def _box(profile: DisplayProfile, right: float, up: float) -> tuple[float, float, float, float]:
    """Left, top, width and height of a subpixel in pixels, from the pixel's left top."""
    subpixels = profile.panel.subpixels
    if isinstance(subpixels, Cells):
        wide, high = 1 / 3, 1 / 3
    else:
        wide, high = (1 / 3, 1.0) if subpixels.axis == "right" else (1.0, 1 / 3)
    return 0.5 + right - wide / 2, 0.5 - up - high / 2, wide, high


def _draw_lens_edges(
    draw: ImageDraw.ImageDraw,
    profile: DisplayProfile,
    first: tuple[int, int],
    size: tuple[int, int],
) -> None:
    """Lines where φ is whole. The formula puts the origin stripe at the pixel's middle; it is
    drawn where it stands."""
    width, height = profile.resolution_px
    subpixels = profile.panel.subpixels
    origin = 0 if isinstance(subpixels, Cells) else "rgb".index(subpixels.origin[0])
    right, up = (0.0, 0.0) if isinstance(subpixels, Cells) else _offset(profile, 0, origin)

    def x_at(lens: int, y_px: float) -> float:
        v = (height - y_px - up) / height
        return ((lens + profile.center) / profile.lens_count - v * profile.drift) * width + right

    ends = (first[1], first[1] + size[1])
    lenses = [
        (x / width + (height - y) / height * profile.drift) * profile.lens_count - profile.center
        for x in (first[0], first[0] + size[0])
        for y in ends
    ]
    for lens in range(math.floor(min(lenses)), math.ceil(max(lenses)) + 1):
        points: list[tuple[float, float]] = [
            (
                _MARGIN + (x_at(lens, y) - first[0]) * _PIXEL,
                _HEAD + _MARGIN + (y - first[1]) * _PIXEL,
            )
            for y in ends
        ]
        clipped = _clipped(points, _MARGIN, _MARGIN + size[0] * _PIXEL)
        if clipped:
            draw.line(clipped, fill=(255, 255, 255), width=5)
            draw.line(clipped, fill=_INK, width=1)


def _clipped(
    points: list[tuple[float, float]], left: float, right: float
) -> list[tuple[float, float]]:
    """The part of a segment between two verticals, or nothing."""
    (x0, y0), (x1, y1) = points
    if x0 == x1:
        return points if left <= x0 <= right else []
    ends = sorted(np.clip([(left - x0) / (x1 - x0), (right - x0) / (x1 - x0)], 0, 1))
    if ends[0] == ends[1]:
        return []
    return [(float(x0 + (x1 - x0) * t), float(y0 + (y1 - y0) * t)) for t in ends]


def _draw_rig(
    draw: ImageDraw.ImageDraw, profile: DisplayProfile, count: int, place: tuple[int, int]
) -> None:
    """Panel, eyes and cone from above, to one scale."""
    eyes = profile.rig(count).eye_x_mm
    half_mm = max(profile.size_mm[0] / 2, float(np.abs(eyes).max()), 1e-6)
    scale = min(_RIG / 2 / half_mm, 300 / profile.distance_mm)
    middle, top = place[0] + _RIG / 2, place[1] + 24
    eye_y = top + profile.distance_mm * scale
    half = profile.size_mm[0] / 2 * scale
    draw.line((middle - half, top, middle + half, top), fill=_INK, width=5)
    draw.text((middle, top - 6), "panel, from above", fill=_INK, anchor="mb", font_size=14)
    reach = math.tan(min(profile.cone_rad / 2, 1.5)) * profile.distance_mm * scale
    for side in (-1, 1):
        edge = (middle + side * reach, eye_y)
        draw.line((middle, top, *edge), fill=_FAINT, width=1)
    for number, x_mm in enumerate(eyes):
        x = middle + float(x_mm) * scale
        draw.ellipse((x - 4, eye_y - 4, x + 4, eye_y + 4), fill=_colour(number / count))
        if number in (0, count - 1):
            draw.text((x, eye_y + 8), str(number), fill=_INK, anchor="mt", font_size=13)
    text = f"{profile.distance_mm:g} mm, cone {profile.viewing.cone_deg:g} degrees, spacing "
    draw.text((middle, eye_y + 40), text + profile.spacing, fill=_INK, anchor="mt", font_size=14)


def _colour(place: float) -> tuple[int, int, int]:
    """A light colour of each place in the cone, from red on the left to violet on the right."""
    red, green, blue = colorsys.hsv_to_rgb(0.8 * place, 0.45, 1.0)
    return round(255 * red), round(255 * green), round(255 * blue)

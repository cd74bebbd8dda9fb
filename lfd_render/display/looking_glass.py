"""Looking Glass `visual.json`: a unit's own calibration, as found on the display.

    P = pitch · (screenW/DPI) · cos(atan(1/slope))
    T = screenH/(screenW·slope), negated if flipImageX

What is read is the plain data of a profile file, which the caller validates like any other; what is
written reads back to the same numbers.
"""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import AliasChoices, BeforeValidator, Field, ValidationError

from lfd_render.display.exact import exactly, json_text, read_exact, shortest
from lfd_render.display.model import ASSUMED_INDEX, KINDS_OF_MODE, SCHEMA, Cells
from lfd_render.display.strict import StrictModel, one_line
from lfd_render.errors import ProfileError

if TYPE_CHECKING:
    from lfd_render.display.exact import Numbers
    from lfd_render.display.profile import DisplayProfile

MM_PER_INCH = Decimal("25.4")
# The file names neither; the views are the Portrait's 8×6 quilt.
ASSUMED_VIEWS = 48
ASSUMED_DISTANCE_MM = 600.0


def _unwrap(value: Any) -> Any:
    """The x of {"value": x}; anything else as it is."""
    return value["value"] if isinstance(value, dict) and value.keys() == {"value"} else value


Number = Annotated[float, BeforeValidator(_unwrap)]
Positive = Annotated[float, Field(gt=0, le=1e12), BeforeValidator(_unwrap)]


class _Cell(StrictModel, extra="ignore"):
    r_x: float = Field(alias="ROffsetX")
    r_y: float = Field(alias="ROffsetY")
    g_x: float = Field(alias="GOffsetX")
    g_y: float = Field(alias="GOffsetY")
    b_x: float = Field(alias="BOffsetX")
    b_y: float = Field(alias="BOffsetY")


class _VisualJson(StrictModel, extra="ignore"):
    """The fields that decide the picture; the vendor's others are passed over."""

    serial: str = ""
    pitch: Positive
    slope: Number
    center: Number
    view_cone: Number = Field(alias="viewCone")
    dpi: Positive = Field(alias="DPI")
    screen_w: Positive = Field(alias="screenW")
    screen_h: Positive = Field(alias="screenH")
    inv_view: Number = Field(default=1.0, alias="invView")
    flip_image_x: Number = Field(default=0.0, alias="flipImageX")
    flip_image_y: Number = Field(default=0.0, alias="flipImageY")
    flip_subp: Number = Field(default=0.0, alias="flipSubp")
    pattern_mode: Number = Field(
        default=0.0, validation_alias=AliasChoices("CellPatternMode", "cellPatternMode")
    )
    cells: tuple[_Cell, ...] = Field(default=(), alias="subpixelCells")


def is_visual_json(data: object) -> bool:
    """Whether parsed JSON is a vendor calibration, maybe an incomplete one, and no profile file."""
    named = {"pitch", "slope", "center", "viewCone", "DPI", "screenW", "screenH"}
    return isinstance(data, dict) and "schema" not in data and len(named & data.keys()) >= 2


def profile_data(text: str, source: str) -> dict[str, Any]:
    """Data of a profile file that says the same as the text of a `visual.json`.

    Raises ProfileError naming the field, also for what a profile cannot express: a picture
    flipped top to bottom.
    """
    try:
        unit = _VisualJson.model_validate_json(text)
    except ValidationError as cause:
        raise ProfileError(one_line(cause, source)) from cause
    _check_expressible(unit, source)
    data = read_exact(text)
    numbers = {name: Decimal(_unwrap(data[name])) for name in _LENS_NUMBERS}
    with exactly():
        lens, size_mm = _lens_and_size(numbers, flipped=bool(unit.flip_image_x))
    return {
        "schema": SCHEMA,
        "name": f"looking-glass-{unit.serial or 'unit'}"[:200],
        **({"serial": unit.serial} if unit.serial else {}),
        "panel": {
            "resolution_px": [int(unit.screen_w), int(unit.screen_h)],
            "size_mm": size_mm,
            "subpixels": _subpixels(unit),
        },
        "lens": {**lens, "center": unit.center, "index": ASSUMED_INDEX},
        "viewing": {
            "views": ASSUMED_VIEWS,
            "cone_deg": unit.view_cone,
            "distance_mm": ASSUMED_DISTANCE_MM,
            "spacing": "lens",
            "inverted": unit.inv_view == 0,
        },
        "provenance": {
            "source": "Looking Glass visual.json",
            "assumed": ["lens.index", "viewing.views", "viewing.distance_mm"],
        },
    }


_LENS_NUMBERS = ("pitch", "slope", "DPI", "screenW", "screenH")


def _lens_and_size(
    numbers: Numbers, *, flipped: bool = False
) -> tuple[dict[str, float], list[float]]:
    """Lens count and drift, and the panel's size in millimetres."""
    pitch, slope, dpi, width, height = (numbers[name] for name in _LENS_NUMBERS)
    drift = height / (width * slope)
    count = pitch * width / dpi / (1 + 1 / (slope * slope)).sqrt()
    size_mm = [float(side / dpi * MM_PER_INCH) for side in (width, height)]
    return {"lens_count": float(count), "drift": float(-drift if flipped else drift)}, size_mm


def visual_json(profile: DisplayProfile) -> str:
    """Text of a `visual.json` that says as much of a profile as it can hold.

    The width gives the DPI; stripes that are no plain ones become one kind of cell. Raises
    ProfileError for upright lenses, whose slope is infinite.
    """
    if profile.drift == 0:
        raise ProfileError(
            f"display '{profile.name}': lens.drift is 0; a visual.json gives the cotangent of the "
            "lens tilt, which upright lenses have none of"
        )
    width, height = (Decimal(side) for side in profile.resolution_px)
    with exactly():
        slope = height / (width * Decimal(profile.drift))
        dpi = width * MM_PER_INCH / Decimal(profile.size_mm[0])
        pitch = Decimal(profile.lens_count) * dpi / width * (1 + 1 / (slope * slope)).sqrt()
        sides = {"screenW": width, "screenH": height}
        exact = {"pitch": pitch, "slope": slope, "DPI": dpi} | sides
        aim = _lens_and_size(exact)
        numbers = shortest(exact, lambda rounded: _lens_and_size(rounded) == aim)
    origin, order, cells = _written_subpixels(profile)
    wrapped: dict[str, Any] = {
        "pitch": numbers["pitch"],
        "slope": numbers["slope"],
        "center": profile.center + origin,
        "fringe": 0.0,
        "viewCone": profile.viewing.cone_deg,
        "invView": 0.0 if profile.viewing.inverted else 1.0,
        "verticalAngle": 0.0,
        "DPI": numbers["DPI"],
        "screenW": profile.resolution_px[0],
        "screenH": profile.resolution_px[1],
        "flipImageX": 0.0,
        "flipImageY": 0.0,
        "flipSubp": float(order == "bgr"),
        **({"CellPatternMode": float(cells[0])} if cells else {}),
    }
    return json_text(
        {
            "configVersion": "3.0",
            "serial": profile.serial or "",
            **{name: {"value": value} for name, value in wrapped.items()},
            **({"subpixelCells": cells[1]} if cells else {}),
        }
    )


def _written_subpixels(
    profile: DisplayProfile,
) -> tuple[float, str, tuple[int, list[dict[str, float]]] | None]:
    """What the origin stripe adds to the centre, the order of stripes, and the cells if it takes
    any, with their mode."""
    subpixels = profile.panel.subpixels
    if isinstance(subpixels, Cells):
        offsets, mode = subpixels.offsets_px, subpixels.pattern_mode
    elif subpixels.axis == "up":
        offsets, mode = (tuple((0.0, up) for up in subpixels.offsets_px()),), 0  # type: ignore[assignment]
    else:
        leftmost = min(subpixels.offsets_px())
        return -leftmost / profile.resolution_px[0] * profile.lens_count, subpixels.order, None
    return 0.0, "rgb", (
        mode,
        [
            {f"{c}Offset{axis}": xy[i] for c, xy in zip("RGB", kind, strict=True)
             for i, axis in enumerate("XY")}
            for kind in offsets
        ],
    )  # fmt: skip


def _check_expressible(unit: _VisualJson, source: str) -> None:
    allowed: dict[str, tuple[float, tuple[float, ...], str]] = {
        "flipImageX": (unit.flip_image_x, (0, 1), "0 or 1"),
        "flipImageY": (unit.flip_image_y, (0,), "0; a picture flipped top to bottom is not known"),
        "flipSubp": (unit.flip_subp, (0, 1), "0 or 1"),
        "invView": (unit.inv_view, (0, 1), "0 or 1"),
        "CellPatternMode": (unit.pattern_mode, tuple(range(len(KINDS_OF_MODE))), "from 0 to 4"),
        "screenW": (unit.screen_w, (int(unit.screen_w),), "a whole number of pixels"),
        "screenH": (unit.screen_h, (int(unit.screen_h),), "a whole number of pixels"),
    }
    for field, (value, accepted, remedy) in allowed.items():
        if value not in accepted:
            raise ProfileError(f"{source}: {field} is {value:g}; it should be {remedy}")
    if unit.slope == 0:
        raise ProfileError(f"{source}: slope is 0; it should be the cotangent of the lens tilt")


def _subpixels(unit: _VisualJson) -> dict[str, Any]:
    """Cells where the unit has them, else stripes with the leftmost one at the origin."""
    if unit.cells:
        cells = [[[c.r_x, c.r_y], [c.g_x, c.g_y], [c.b_x, c.b_y]] for c in unit.cells]
        return {"layout": "cells", "pattern_mode": int(unit.pattern_mode), "offsets_px": cells}
    if unit.flip_subp:
        return {"layout": "stripe", "order": "bgr", "origin": "blue-at-pixel-centre"}
    return {"layout": "stripe", "order": "rgb", "origin": "red-at-pixel-centre"}

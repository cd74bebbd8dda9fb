"""Looking Glass `visual.json`: a unit's own calibration, as found on the display.

    P = pitch · (screenW/DPI) · cos(atan(1/slope))
    T = screenH/(screenW·slope), negated if flipImageX

The result is the plain data of a profile file, which the caller validates like any other.
"""

import math
from typing import Annotated, Any

from pydantic import AliasChoices, BeforeValidator, Field, ValidationError

from lfd_render.display.model import ASSUMED_INDEX, KINDS_OF_MODE, SCHEMA
from lfd_render.display.strict import StrictModel, one_line
from lfd_render.errors import ProfileError

MM_PER_INCH = 25.4
# The file names neither; the views are the Portrait's 8×6 quilt.
ASSUMED_VIEWS = 48
ASSUMED_DISTANCE_MM = 600.0


def _unwrap(value: Any) -> Any:
    """The x of {"value": x}; anything else as it is."""
    return value["value"] if isinstance(value, dict) and value.keys() == {"value"} else value


Number = Annotated[float, BeforeValidator(_unwrap)]
Positive = Annotated[float, Field(gt=0, le=1e6), BeforeValidator(_unwrap)]


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
    flipped top to bottom, and views in reverse order.
    """
    try:
        unit = _VisualJson.model_validate_json(text)
    except ValidationError as cause:
        raise ProfileError(one_line(cause, source)) from cause
    _check_expressible(unit, source)
    width, height = int(unit.screen_w), int(unit.screen_h)
    drift = unit.screen_h / (unit.screen_w * unit.slope)
    return {
        "schema": SCHEMA,
        "name": f"looking-glass-{unit.serial or 'unit'}",
        **({"serial": unit.serial} if unit.serial else {}),
        "panel": {
            "resolution_px": [width, height],
            "size_mm": [side / unit.dpi * MM_PER_INCH for side in (width, height)],
            "subpixels": _subpixels(unit),
        },
        "lens": {
            "lens_count": unit.pitch
            * (unit.screen_w / unit.dpi)
            * math.cos(math.atan(1 / unit.slope)),
            "drift": -drift if unit.flip_image_x else drift,
            "center": unit.center,
            "index": ASSUMED_INDEX,
        },
        "viewing": {
            "views": ASSUMED_VIEWS,
            "cone_deg": unit.view_cone,
            "distance_mm": ASSUMED_DISTANCE_MM,
            "spacing": "lens",
        },
        "provenance": {
            "source": "Looking Glass visual.json",
            "assumed": ["lens.index", "viewing.views", "viewing.distance_mm"],
        },
    }


def _check_expressible(unit: _VisualJson, source: str) -> None:
    allowed: dict[str, tuple[float, tuple[float, ...], str]] = {
        "flipImageX": (unit.flip_image_x, (0, 1), "0 or 1"),
        "flipImageY": (unit.flip_image_y, (0,), "0; a picture flipped top to bottom is not known"),
        "flipSubp": (unit.flip_subp, (0, 1), "0 or 1"),
        "invView": (unit.inv_view, (1,), "1; views in reverse order are not known"),
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

"""Vendor calibration files: recognised by content, read by the published formulas."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lfd_render.display import DisplayProfile
from lfd_render.display.model import Cells, Stripes
from lfd_render.errors import ProfileError


def visual_json(**changes: Any) -> dict[str, Any]:
    """A Portrait's file, each number wrapped as the vendor does; `...` leaves a field out."""
    numbers = {
        "pitch": 52.594, "slope": -7.2115, "center": 0.40277, "fringe": 0.0, "viewCone": 40.0,
        "invView": 1.0, "verticalAngle": 0.0, "DPI": 324.0, "screenW": 1536.0, "screenH": 2048.0,
        "flipImageX": 0.0, "flipImageY": 0.0, "flipSubp": 0.0,
    }  # fmt: skip
    data: dict[str, Any] = {"configVersion": "3.0", "serial": "LKG-P00001"}
    data |= {key: {"value": value} for key, value in numbers.items()}
    return {k: v for k, v in (data | changes).items() if v is not ...}


def read(**changes: Any) -> DisplayProfile:
    return DisplayProfile.from_json(json.dumps(visual_json(**changes)), source="visual.json")


def test_a_file_is_recognised_by_content(tmp_path: Path) -> None:
    path = tmp_path / "anything.txt"
    path.write_text(json.dumps(visual_json()))
    profile = DisplayProfile.load(path)
    assert profile.name == "looking-glass-LKG-P00001"
    assert profile.serial == "LKG-P00001"
    assert profile.resolution_px == (1536, 2048)
    assert profile.size_mm == pytest.approx((1536 / 324 * 25.4, 2048 / 324 * 25.4))
    assert not profile.template  # it is this unit's own calibration
    assert "viewing.distance_mm" in profile.provenance.assumed
    sample = DisplayProfile.load("looking-glass-portrait-sample-a")
    assert (profile.lens, profile.panel) == (sample.lens, sample.panel)


def test_numbers_may_stand_bare() -> None:
    assert read(pitch=52.594, slope=-7.2115) == read()


def test_flip_x_turns_the_lean_round() -> None:
    assert read(flipImageX={"value": 1.0}).drift == -read().drift


def test_flipped_subpixels_start_with_blue_at_the_left() -> None:
    flipped = read(flipSubp={"value": 1.0})
    assert flipped.panel.subpixels == Stripes(order="bgr", origin="blue-at-pixel-centre")
    plain, swapped = read().phase_map()[:9, :9], flipped.phase_map()[:9, :9]
    assert (swapped == plain[..., ::-1]).all()


@pytest.mark.parametrize("key", ["CellPatternMode", "cellPatternMode"])
def test_cells_are_read_as_they_stand(key: str) -> None:
    names = ("ROffsetX", "ROffsetY", "GOffsetX", "GOffsetY", "BOffsetX", "BOffsetY")
    rng = np.random.default_rng(5)
    cells = [
        dict(zip(names, map(float, row), strict=True)) for row in rng.uniform(-0.4, 0.4, (2, 6))
    ]
    profile = read(subpixelCells=cells, **{key: {"value": 2.0}})
    subpixels = profile.panel.subpixels
    assert isinstance(subpixels, Cells)
    assert subpixels.pattern_mode == 2
    for got, cell in zip(subpixels.offsets_px, cells, strict=True):
        assert [v for xy in got for v in xy] == [cell[name] for name in names]

    # φ = (u + Xoff/W + (v + Yoff/H)·T)·P − center on a pixel of the second kind
    phase = profile.phase_map()[2047 - 40, 31]
    count = 52.594 * (1536 / 324) * math.cos(math.atan(1 / -7.2115))
    drift = 2048 / (1536 * -7.2115)
    for c, channel in enumerate("RGB"):
        u = (31.5 + cells[1][f"{channel}OffsetX"]) / 1536
        v = (40.5 + cells[1][f"{channel}OffsetY"]) / 2048
        assert phase[c] == pytest.approx((u + v * drift) * count - 0.40277, abs=1e-12)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"DPI": ...}, "DPI is missing"),
        ({"pitch": ...}, "pitch is missing"),
        ({"pitch": ..., "slope": ..., "DPI": ...}, "pitch is missing.* \\(and 2 more\\)"),
        ({"pitch": {"value": "52"}}, "pitch is '52'"),
        ({"pitch": {"value": -52.0}}, "pitch is -52.0; it should be greater than 0"),
        ({"center": {"value": math.nan}}, "center is nan"),
        ({"slope": {"value": 0}}, "slope is 0; it should be the cotangent"),
        ({"screenW": {"value": 1536.5}}, "screenW is 1536.5; it should be a whole number"),
        ({"flipImageY": {"value": 1}}, "flipImageY is 1; it should be 0"),
        ({"invView": {"value": 2}}, "invView is 2; it should be 0 or 1"),
        ({"viewCone": {"value": 200}}, "viewing.cone_deg is 200"),
        ({"CellPatternMode": {"value": 7}}, "CellPatternMode is 7; it should be from 0 to 4"),
        ({"subpixelCells": [{"ROffsetX": 0.1}]}, "subpixelCells.0.ROffsetY is missing"),
    ],
)
def test_bad_vendor_files_are_named(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ProfileError, match=f"^visual.json: {message}"):
        read(**changes)

"""What the format says beyond plain stripes, and how wrong values are refused."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lfd_render.display import DisplayProfile, PhaseTables
from lfd_render.display.convert import convert
from lfd_render.display.migration import to_present
from lfd_render.display.mounted import mounted_calibrations
from lfd_render.display.plausible import doubts
from lfd_render.errors import ProfileError, UsageError
from lfd_render.panel.check import view_errors
from lfd_render.panel.layout import layout_picture
from lfd_render.panel.look import look
from lfd_render.panel.unweave import unweave

from .wild_profiles import profile_data

PAPER = DisplayProfile.load("gavane-2024-tilted-4k")


def read(**changes: Any) -> DisplayProfile:
    """The paper's display with fields set by section__field; `...` takes one out."""
    data = json.loads(PAPER.to_json())
    for path, value in changes.items():
        *sections, field = path.split("__")
        part = data
        for section in sections:
            part = part[section]
        if value is ...:
            part.pop(field)
        else:
            part[field] = value
    return DisplayProfile.from_json(json.dumps(data), "p.json")


# -- counts and distances ----------------------------------------------------------------------


def test_the_sheets_own_count_and_pitch_follow_from_the_gap() -> None:
    profile = read(lens__gap_mm=1.2)
    count = 479.36 * (1 + 1.2 / (1.49 * 600))
    assert profile.physical_lens_count == pytest.approx(count, rel=1e-15)
    tilt = profile.tilt_rad
    assert profile.pitch_mm == pytest.approx(345.4 / count * math.cos(tilt), rel=1e-15)
    assert PAPER.physical_lens_count is None
    assert PAPER.pitch_mm is None
    told = read(lens__gap_mm=1.2, lens__lens_count=..., lens__physical_lens_count=count)
    assert told.lens_count == pytest.approx(479.36, rel=1e-15)


def test_another_distance_sees_another_lattice_about_the_same_middle() -> None:
    near = read(lens__gap_mm=1.2).at_distance(400)
    assert near.lens_count == pytest.approx(
        479.36 * (1 + 1.2 / (1.49 * 600)) / (1 + 1.2 / (1.49 * 400)), rel=1e-14
    )
    for profile in (near, PAPER):
        middle = (0.5 + 0.5 * profile.drift) * profile.lens_count - profile.center
        assert middle == pytest.approx((0.5 + 0.5 * PAPER.drift) * 479.36, abs=1e-11)
    assert near.at_distance(600).lens_count == pytest.approx(479.36, rel=1e-15)
    with pytest.raises(ProfileError, match="gap_mm is missing"):
        PAPER.at_distance(400)
    with pytest.raises(UsageError, match="distance is nan"):
        near.at_distance(math.nan)


# -- the map -----------------------------------------------------------------------------------


def slow_map(tables: PhaseTables, views: int) -> np.ndarray:
    """Views from whole sums of 64 bits."""
    width, height = tables.size_px
    fixed = tables.fixed(views)
    return fixed.view(tables.fixed_phase(fixed, np.arange(width), np.arange(height)))


@pytest.mark.parametrize("inverted", [False, True])
def test_short_words_give_the_map_of_whole_sums(inverted: bool) -> None:
    rng = np.random.default_rng(3)
    for n in range(60):
        data = profile_data(rng)
        data["panel"]["resolution_px"] = [int(px) for px in rng.integers(8, 60, 2)]
        data["panel"]["size_mm"] = [100.0, 100.0]
        data["lens"]["lens_count"] = float(rng.uniform(1, data["panel"]["resolution_px"][0]))
        if n % 3 == 0:  # phases on boundaries, and on whole lenses
            data["lens"] |= {"lens_count": 8.0, "drift": 0.5, "center": 0.25}
            data["panel"]["resolution_px"] = [32, 16]
        data["viewing"]["inverted"] = inverted
        tables = DisplayProfile.from_json(json.dumps(data)).phase_tables()
        for views in (1, 2, 8, 4096):
            np.testing.assert_array_equal(
                tables.view_index_map(views), slow_map(tables, views), err_msg=str(data)
            )


@pytest.mark.shows("the view-index map of a 7680 x 4320 panel, against a scalar loop of float64")
def test_the_map_of_an_8k_panel_is_a_scalar_loop() -> None:
    profile = read(panel__resolution_px=[7680, 4320], lens__center=0.123)
    views = profile.view_index_map(48)
    count, drift, center = profile.lens_count, profile.drift, profile.center
    rng = np.random.default_rng(5)
    wrong = 0
    for x, y, c in zip(
        rng.integers(7680, size=40_000).tolist(),
        rng.integers(4320, size=40_000).tolist(),
        rng.integers(3, size=40_000).tolist(),
        strict=True,
    ):
        u, v = (x + 0.5) / 7680, (4319 - y + 0.5) / 4320
        phase = (u + c / (3 * 7680) + v * drift) * count - center
        wrong += views[y, x, c] != min(math.floor((1 - (phase - math.floor(phase))) * 48), 47)
    assert wrong == 0


def test_inverted_views_are_counted_the_other_way() -> None:
    plain, inverted = PAPER.view_index_map(48), read(viewing__inverted=True).view_index_map(48)
    same = plain + inverted == 47
    assert same.mean() > 1 - 1e-5  # all but phases on a view's boundary


@pytest.mark.parametrize("inverted", [False, True])
def test_eyes_see_the_views_meant_for_them(inverted: bool) -> None:
    """Also through inverted views, a correction and stripes above each other."""
    grid = [[0.0, 0.2, -0.1], [0.1, -0.15, 0.0]]
    profile = read(
        viewing__inverted=inverted,
        viewing__views=9,
        correction={"phase_lenses": grid},
        panel__resolution_px=[1200, 700],
        lens__lens_count=150.0,
        panel__subpixels={"layout": "stripe", "order": "bgr", "axis": "up"},
    )
    index = profile.view_index_map(9)
    levels = (25 * np.arange(9)).astype(np.uint8)
    eyes = profile.rig(9).eye_x_mm
    for view in (0, 2, 4, 8):
        seen = look(levels[index], profile, math.atan(eyes[view] / profile.distance_mm))
        inner = seen[5:-5, 10:-10].astype(int) // 25
        # Nearest subpixels are up to half a pixel, 0.56 of a view, from the eye's place.
        assert np.abs(inner - view).max() <= 1
        assert abs(inner.mean() - view) < 0.15
    woven = unweave(levels[index], profile, 9)
    assert woven.collisions == 0


def test_a_correction_changes_the_phase_by_its_grid() -> None:
    grid = [[0.0, 0.4], [0.1, 0.3]]
    profile = read(correction={"phase_lenses": grid})
    added = profile.phase_tables().phase(slice(0, 2160, 2159)) - (
        PAPER.phase_tables().phase(slice(0, 2160, 2159))
    )
    assert added[0, 0] == pytest.approx([0.0] * 3, abs=1e-3)
    assert added[0, -1] == pytest.approx([0.4] * 3, abs=1e-3)
    assert added[-1, 1920] == pytest.approx([0.2] * 3, abs=1e-3)
    errors = view_errors(PAPER, profile, 48)
    assert errors.corners["top_right"] == pytest.approx(-0.4 * 48, abs=0.05)
    assert view_errors(profile, profile, 48).largest == 0


# -- hash --------------------------------------------------------------------------------------


def test_equal_profiles_have_one_hash_and_new_fields_change_it() -> None:
    assert read(lens__center=-0.0) == PAPER
    assert read(lens__center=-0.0).hash == PAPER.hash
    others = [
        read(viewing__inverted=True),
        read(panel__mount={"rotation_deg": 180}),
        read(correction={"phase_lenses": [[0.0, 0.1], [0.0, 0.0]]}),
        read(panel__subpixels={"layout": "stripe", "axis": "up"}),
        PAPER,
    ]
    assert len({profile.hash for profile in others}) == len(others)


# -- versions ----------------------------------------------------------------------------------


def test_an_older_form_is_brought_to_the_present_one() -> None:
    data = json.loads(PAPER.to_json())
    present = dict(data)
    older = {**data, "schema": "lfd-display/0"}
    older["lenses"] = older.pop("lens")
    eldest = {**older, "schema": "lfd-display/-1"}
    eldest["title"] = eldest.pop("name")
    steps = {
        "lfd-display/-1": lambda d: {
            **{k: v for k, v in d.items() if k != "title"},
            "schema": "lfd-display/0",
            "name": d["title"],
        },
        "lfd-display/0": lambda d: {
            **{k: v for k, v in d.items() if k != "lenses"},
            "schema": "lfd-display/1",
            "lens": d["lenses"],
        },
    }
    for form in (older, eldest):
        assert to_present(form, "old.json", steps) == present
    assert to_present(present, "new.json", steps) is present
    with pytest.raises(
        ProfileError, match=r"old.json: schema is 'lfd-display/0'; it should be 'lf"
    ):
        to_present(older, "old.json")
    round_about = {"lfd-display/0": lambda d: d}
    with pytest.raises(ProfileError, match="schema is 'lfd-display/0'"):
        to_present(older, "old.json", round_about)


# -- bad input -----------------------------------------------------------------------------------


@pytest.mark.shows("bad profiles are refused with the field and what would be right")
@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"lens__lens_count": ..., "lens__pitch_mm": 0.00071, "lens__gap_mm": 1.0},
            r"lens.pitch_mm is 0.00071, .* in millimetres.*in metres it would be 0.71 mm",
        ),
        (
            {"lens__lens_count": ..., "lens__pitch_mm": 710.0, "lens__gap_mm": 1.0},
            "in micrometres it would be 0.71 mm",
        ),
        (
            {"lens__lens_count": ..., "lens__pitch_mm": 0.71},
            "lens.gap_mm is missing; lens.pitch_mm needs it",
        ),
        (
            {"lens__physical_lens_count": 470.0, "lens__gap_mm": 1.2},
            "lens.physical_lens_count 470.0 and lens.lens_count 479.36 disagree by",
        ),
        ({"panel__size_mm": [0.3454, 0.1943]}, "panel.size_mm is .* looks like metres"),
        ({"date": "2023-02-29"}, "date is '2023-02-29'; it should be a day"),
        ({"panel__subpixels": {"layout": "cells", "offsets_px": []}}, "pattern_mode is missing"),
        ({"panel__mount": {"rotation_deg": 45}}, "panel.mount.rotation_deg is 45"),
        ({"correction": {"phase_lenses": [[0, 0], [0]]}}, "correction.phase_lenses.1 "),
        ({"correction": {"phase_lenses": [[0, 0, 0], [0, 0]]}}, "phase_lenses.1 has 2 columns"),
        ({"schema": "lfd-display/2"}, "schema is 'lfd-display/2'; it should be 'lfd-display/1'"),
        ({"provenance__fields": [{"field": "colour", "source": "x"}]}, "provenance.fields.0.field"),
    ],
)
def test_bad_values_say_what_would_be_right(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ProfileError, match=f"^p.json: .*{message}"):
        read(**changes)


def test_a_file_of_4_gb_is_refused_unread(tmp_path: Path) -> None:
    path = tmp_path / "large.json"
    with path.open("wb") as file:
        file.truncate(4 << 30)
    with pytest.raises(ProfileError, match=r"large.json: is 4294967296 bytes, larger than"):
        DisplayProfile.load(path)


FORM = {
    "schema": "lfd-display-form/1",
    "form": "van-berkel",
    "numbers": {"subpixels_per_lens": 24.0, "tan_alpha": 0.1, "k_off": 0.0},
    "profile": {**json.loads(PAPER.to_json()), "lens": {}},
}
INI = convert(PAPER, "3d-global").text


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (json.dumps(FORM | {"form": "x"}), "form is 'x'; it should be van-berkel or physical"),
        (json.dumps(FORM | {"numbers": {}}), "numbers.subpixels_per_lens is missing"),
        (json.dumps(FORM).replace("24.0", "0"), "subpixels_per_lens is 0; it should be above 0"),
        (json.dumps(FORM).replace("24.0", "NaN"), "subpixels_per_lens is nan; it should be a fin"),
        (json.dumps(FORM).replace("24.0", '"24"'), "subpixels_per_lens is '24'; it should be a nu"),
        (json.dumps(FORM).replace("24.0", "1e999"), "subpixels_per_lens is .*finite"),
        (json.dumps(FORM | {"profile": 7}), "profile is missing"),
        (json.dumps(FORM | {"profile": {}}), "profile.panel.resolution_px.0 is None"),
        (json.dumps(FORM | {"colour": 7}), "colour is not a known field"),
        (INI.replace("views = 24", "views = 0"), "interlacing.views is '0'; it should be a whole"),
        (INI.replace("views = 24", ""), "interlacing.views is missing"),
        (INI.replace("direction = 1", "direction = 0"), "direction is 0; it should be 1 or -1"),
        (INI.replace("width_px = 3840", "width_px = nan"), "panel.width_px is 'nan'"),
        (INI.replace("width_px = 3840", "width_px = 38.5"), "panel.width_px is 38.5"),
        ("[panel]\n[panel]\n", "is not a valid INI"),
    ],
)
def test_bad_files_of_other_systems_are_named(text: str, message: str) -> None:
    with pytest.raises(ProfileError, match=f"^other: .*{message}"):
        DisplayProfile.from_json(text, "other")


def test_formats_refuse_what_they_have_no_words_for() -> None:
    with pytest.raises(ProfileError, match=r"lens.drift is 0; a visual.json"):
        convert(read(lens__drift=0.0), "looking-glass")
    with pytest.raises(ProfileError, match=r"lens.gap_mm is missing; the pitch"):
        convert(PAPER, "physical")
    up = read(panel__subpixels={"layout": "stripe", "axis": "up"})
    for name in ("van-berkel", "leia", "3d-global"):
        with pytest.raises(ProfileError, match=r"panel.subpixels"):
            convert(up, name)
    with pytest.raises(UsageError, match="format 'x': unknown; use profile, looking-glass"):
        convert(PAPER, "x")


def test_a_3d_global_file_comes_back_to_the_letter() -> None:
    text = INI.replace("views = 24", "views = 7").replace("offset = 3", "offset = 5")
    profile = DisplayProfile.from_json(text)
    again = convert(profile, "3d-global")
    assert not again.lost
    assert again.read_back == profile
    assert again.text == text


def test_vendor_numbers_come_out_as_they_stood() -> None:
    told = {"pitch": 52.594, "slope": -7.2115, "center": 0.40277, "viewCone": 40.0, "DPI": 324.0}
    told |= {"screenW": 1536, "screenH": 2048}
    profile = DisplayProfile.from_json(json.dumps({"serial": "P", **told}))
    written = json.loads(convert(profile, "looking-glass").text)
    for name, value in told.items():
        assert written[name]["value"] == pytest.approx(value, rel=4e-16)
    assert not convert(profile, "looking-glass").lost


def test_hardly_meant_figures_are_doubted() -> None:
    assert not doubts(PAPER)
    assert not doubts(read(lens__gap_mm=1.4))
    assert "in metres it would be 600 mm" in doubts(read(viewing__distance_mm=0.6))[0]
    assert "makes a cone of" in doubts(read(lens__gap_mm=14.0))[0]
    assert "makes pixels of" in doubts(read(panel__size_mm=[194.3, 345.4]))[0]
    assert "is it in radians?" in doubts(read(viewing__cone_deg=0.7))[0]


# -- mounted drives ------------------------------------------------------------------------------


def test_auto_is_the_one_mounted_display(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    roots = [tmp_path / "a", tmp_path / "b"]
    monkeypatch.setenv("LFD_CALIBRATION_ROOTS", ":".join(map(str, roots)))
    with pytest.raises(ProfileError, match=r"display auto: no LKG_calibration/visual.json in"):
        DisplayProfile.load("auto")
    text = convert(DisplayProfile.load("looking-glass-portrait-sample-a"), "looking-glass").text
    for root in roots:
        folder = root / "LKG_calibration"
        folder.mkdir(parents=True)
        if root == roots[0]:
            (folder / "visual.json").write_text(text)
            assert DisplayProfile.load("auto").resolution_px == (1536, 2048)
    (folder / "visual.json").write_text(text)
    assert len(mounted_calibrations()) == 2
    assert len(mounted_calibrations([roots[0], roots[0]])) == 1
    with pytest.raises(ProfileError, match="display auto: 2 calibrations"):
        DisplayProfile.load("auto")


# -- the picture ---------------------------------------------------------------------------------


def test_the_picture_shows_views_of_the_middle() -> None:
    rng = np.random.default_rng(1)
    for _ in range(6):
        profile = DisplayProfile.from_json(json.dumps(profile_data(rng)))
        picture = layout_picture(profile)
        assert picture.dtype == np.uint8
        assert picture.shape[2] == 3
    plain, shifted = layout_picture(PAPER), layout_picture(read(lens__center=0.5))
    assert np.count_nonzero(plain != shifted) > 10_000

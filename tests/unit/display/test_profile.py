"""The profile format: lossless, strict, and clear about what is wrong."""

import json
import math
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lfd_render.display import DisplayProfile, shipped_profiles
from lfd_render.display.strict import MAX_JSON_BYTES
from lfd_render.errors import OutputError, ProfileError, UsageError

REPOSITORY = Path(__file__).parents[3]


def paper() -> dict[str, Any]:
    """Plain data of the paper's display."""
    data: dict[str, Any] = json.loads(DisplayProfile.load("gavane-2024-tilted-4k").to_json())
    return data


def with_field(field: str, value: Any) -> dict[str, Any]:
    """The paper's display with one field set, or removed when the value is `...`."""
    data = paper()
    *sections, last = field.split(".")
    part = data
    for section in sections:
        part = part[section]
    if value is ...:
        del part[last]
    else:
        part[last] = value
    return data


def read(data: dict[str, Any]) -> DisplayProfile:
    return DisplayProfile.from_json(json.dumps(data), source="panel.json")


# -- round trip ----------------------------------------------------------------------------


def numbers(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False)


offset = st.tuples(numbers(-2, 2), numbers(-2, 2))
subpixels = st.one_of(
    st.fixed_dictionaries(
        {
            "layout": st.just("stripe"),
            "order": st.sampled_from(["rgb", "bgr"]),
            "origin": st.sampled_from(["red-at-pixel-centre", "blue-at-pixel-centre"]),
        }
    ),
    st.fixed_dictionaries(
        {
            "layout": st.just("cells"),
            "pattern_mode": st.integers(0, 4),
            "offsets_px": st.lists(st.tuples(offset, offset, offset), min_size=4, max_size=5),
        }
    ),
)
profiles = st.fixed_dictionaries(
    {
        "schema": st.just("lfd-display/1"),
        "name": st.text(st.characters(codec="utf-8"), min_size=1, max_size=40),
        "panel": st.fixed_dictionaries(
            {
                "resolution_px": st.tuples(st.integers(600, 8000), st.integers(1, 8000)),
                "size_mm": st.tuples(numbers(8, 1e5), numbers(8, 1e5)),
                "subpixels": subpixels,
            }
        ),
        "lens": st.fixed_dictionaries(
            {
                "lens_count": numbers(1, 600),
                "drift": numbers(-10, 10),
                "center": numbers(-1e6, 1e6),
                "index": numbers(1, 4),
            },
            optional={"gap_mm": numbers(1e-9, 1e5)},
        ),
        "viewing": st.fixed_dictionaries(
            {
                "views": st.integers(1, 4096),
                "cone_deg": numbers(1e-6, 179.9),
                "distance_mm": numbers(1e-3, 1e6),
                "spacing": st.sampled_from(["lens", "angle", "tangent"]),
            }
        ),
    },
    optional={
        "serial": st.text(st.characters(codec="utf-8"), min_size=1, max_size=9),
        "date": st.just("2024-02-29"),
        "response": st.fixed_dictionaries(
            {"kind": st.just("gaussian"), "sigma_views": st.tuples(*[numbers(0, 48)] * 3)}
        ),
        "uncertainty": st.fixed_dictionaries({}, optional={"center": numbers(0, 1)}),
        "provenance": st.fixed_dictionaries({"source": st.text(max_size=20)}),
    },
)


@settings(derandomize=True, deadline=None, max_examples=150)
@given(profiles)
def test_a_saved_profile_loads_back_equal(
    tmp_path_factory: pytest.TempPathFactory, data: dict[str, Any]
) -> None:
    profile = read(data)
    path = tmp_path_factory.getbasetemp() / "profile.json"
    profile.save(path)
    loaded = DisplayProfile.load(path)
    assert loaded == profile
    assert loaded.hash == profile.hash
    assert loaded.to_json() == profile.to_json()
    assert profile.lens_count == data["lens"]["lens_count"]
    assert profile.center == data["lens"]["center"]


def test_saving_leaves_one_file_and_names_an_impossible_folder(tmp_path: Path) -> None:
    profile = DisplayProfile.load("gavane-2024-tilted-4k")
    profile.save(tmp_path / "p.json")
    assert [p.name for p in tmp_path.iterdir()] == ["p.json"]
    with pytest.raises(OutputError, match=r"nowhere.*cannot be written: No such file"):
        profile.save(tmp_path / "nowhere" / "p.json")


def test_profiles_are_immutable_and_hashable() -> None:
    profile = DisplayProfile.load("gavane-2024-tilted-4k")
    assert profile in {profile}
    with pytest.raises(ValueError, match="frozen"):
        profile.name = "other"


def test_hash_follows_what_changes_the_picture() -> None:
    base = read(paper()).hash
    assert read(with_field("name", "renamed")).hash == base
    assert read(with_field("provenance.source", "elsewhere")).hash == base
    assert read(with_field("lens.center", 1e-12)).hash != base
    assert read(with_field("response.sigma_views", [1, 0, 0])).hash != base
    # Stable: caches and reports made by earlier versions compare with it.
    assert base == "8fd2430e123043dc"


# -- the paper's display -------------------------------------------------------------------


def test_figures_of_the_paper() -> None:
    profile = DisplayProfile.load("gavane-2024-tilted-4k")
    width, height = profile.resolution_px
    pixels_a_lens = width / profile.lens_count
    assert pixels_a_lens == pytest.approx(8.011, abs=5e-4)
    assert profile.views / (3 * pixels_a_lens) == pytest.approx(1.997, abs=5e-4)
    row_views = abs(profile.drift) * profile.lens_count / height * profile.views
    assert row_views == pytest.approx(1.020, abs=5e-4)
    assert profile.size_mm[0] / profile.lens_count == pytest.approx(0.7205, abs=5e-5)
    # The drift was rounded from tan 9.66° in pixels; in millimetres that is 0.0006° less.
    assert math.degrees(profile.tilt_rad) == pytest.approx(-9.66, abs=7e-4)
    assert profile.template


# -- other ways of saying it -----------------------------------------------------------------


def test_tilt_stands_for_drift() -> None:
    data = with_field("lens.drift", ...)
    data["lens"]["tilt_deg"] = -9.66
    profile = read(data)
    expected = 194.3 / 345.4 * math.tan(math.radians(-9.66))
    assert profile.drift == pytest.approx(expected, rel=1e-15)
    assert math.degrees(profile.tilt_rad) == pytest.approx(-9.66, abs=1e-12)
    assert "tilt_deg" not in profile.to_json()


def test_pitch_and_gap_stand_for_the_count_that_the_eye_sees() -> None:
    data = with_field("lens.lens_count", ...)
    data["lens"] |= {"pitch_mm": 0.7, "gap_mm": 1.2, "index": 1.5, "tilt_deg": 12.0}
    del data["lens"]["drift"]
    period = 0.7 / math.cos(math.radians(12)) * (1 + 1.2 / (1.5 * 600))
    assert read(data).lens_count == pytest.approx(345.4 / period, rel=1e-14)


def test_two_ways_that_agree_keep_the_canonical_number() -> None:
    assert read(with_field("lens.tilt_deg", -9.66)).drift == paper()["lens"]["drift"]


def test_two_ways_that_disagree_say_by_how_many_views() -> None:
    with pytest.raises(ProfileError, match=r"panel.json: lens.tilt_deg -9.76 .*disagree") as error:
        read(with_field("lens.tilt_deg", -9.76))
    # 0.01° of tilt is 2.3 views over the height.
    views = float(str(error.value).split("disagree by ")[1].split()[0])
    assert views == pytest.approx(10 * 2.3, rel=0.03)

    data = with_field("lens.pitch_mm", 0.7103)
    data["lens"]["gap_mm"] = 1.0
    with pytest.raises(ProfileError, match=r"lens.pitch_mm 0.7103 and lens.lens_count 479.36 dis"):
        read(data)


# -- bad input -------------------------------------------------------------------------------

BAD_FIELDS = [
    ("schema", ..., "schema is missing"),
    ("schema", "lfd-display/2", "schema is 'lfd-display/2'"),
    ("name", "", "name is ''"),
    ("panel", ..., "panel is missing"),
    ("panel.resolution_px", [3840], r"panel.resolution_px.1 is missing"),
    ("panel.resolution_px", [0, 2160], "panel.resolution_px.0 is 0; it should be greater"),
    ("panel.resolution_px", [3840.5, 2160], "panel.resolution_px.0 is 3840.5"),
    ("panel.resolution_px", [400, 2160], r"lens.lens_count is 479.36; it should be at least 1 and"),
    ("panel.size_mm", [345.4, -1], "panel.size_mm.1 is -1"),
    ("panel.size_mm", ["345.4", 194.3], "panel.size_mm.0 is '345.4'"),
    ("panel.subpixels.layout", "pentile", "panel.subpixels"),
    ("panel.subpixels.order", "grb", "panel.subpixels.stripe.order is 'grb'"),
    ("panel.colour", "red", "panel.colour is not a known field"),
    ("lens.lens_count", -479.36, "lens.lens_count is -479.36; it should be greater"),
    ("lens.lens_count", math.nan, "lens.lens_count is nan; it should be a finite number"),
    ("lens.lens_count", math.inf, "lens.lens_count is inf"),
    ("lens.lens_count", True, "lens.lens_count is True"),
    ("lens.lens_count", ..., "lens.lens_count is missing; add it, or lens.pitch_mm with"),
    ("lens.drift", ..., "lens.drift is missing; add lens.drift or lens.tilt_deg"),
    ("lens.pitch_mm", 0.7, "lens.gap_mm is missing"),
    ("lens.tilt_deg", 90, "lens.tilt_deg is 90"),
    ("lens.index", 0.9, "lens.index is 0.9"),
    ("viewing.views", 0, "viewing.views is 0; it should be greater than or equal to 1"),
    ("viewing.views", 1e6, "viewing.views is 1000000.0"),
    ("viewing.cone_deg", 0, "viewing.cone_deg is 0; it should be greater than 0"),
    ("viewing.cone_deg", 180, "viewing.cone_deg is 180; it should be less than 180"),
    ("viewing.distance_mm", 0, "viewing.distance_mm is 0"),
    ("viewing.spacing", "even", "viewing.spacing is 'even'"),
    ("response.sigma_views", [0, 0, -1], "response.sigma_views.2 is -1"),
    ("provenance.template", "yes", "provenance.template is 'yes'"),
]


@pytest.mark.parametrize(("field", "value", "message"), BAD_FIELDS)
def test_bad_fields_are_named(field: str, value: Any, message: str) -> None:
    with pytest.raises(ProfileError, match=f"^panel.json: {message}") as error:
        read(with_field(field, value))
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 300


def test_too_few_cells_are_named() -> None:
    cells = {"layout": "cells", "pattern_mode": 3, "offsets_px": [[[0, 0]] * 3] * 2}
    with pytest.raises(ProfileError, match=r"offsets_px has 2 cells; pattern mode 3 needs 4"):
        read(with_field("panel.subpixels", cells))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is not valid JSON"),
        (b'{"schema": ', "is not valid JSON"),
        (b"\xff\xfe{}", "byte 0 is not UTF-8"),
        (b"[" * 100_000, "is not valid JSON"),
        (b"[1, 2]", "the top level is"),
        (b"7" * 5000, "is not valid JSON"),
        (b" " * (MAX_JSON_BYTES + 1), "is 4194305 bytes, larger than 4194304 bytes"),
    ],
)
def test_bad_files_are_named(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "bad.json"
    path.write_bytes(content)
    with pytest.raises(ProfileError, match=rf"bad\.json: {message}") as error:
        DisplayProfile.load(path)
    assert "\n" not in str(error.value)


def test_missing_files_and_folders_are_named(tmp_path: Path) -> None:
    with pytest.raises(ProfileError, match=r"gone\.json: cannot be read: No such file"):
        DisplayProfile.load(tmp_path / "gone.json")
    with pytest.raises(ProfileError, match="cannot be read: Is a directory"):
        DisplayProfile.load(tmp_path)
    with pytest.raises(ProfileError, match="is no file name"):
        DisplayProfile.load("a\0.json")


def test_a_wrong_name_lists_near_ones() -> None:
    with pytest.raises(ProfileError, match=r"'gavane-2024'.*did you mean gavane-2024-tilted-4k\?"):
        DisplayProfile.load("gavane-2024")
    with pytest.raises(ProfileError, match="there are gavane-2024-tilted-4k, looking-glass"):
        DisplayProfile.load("zzz")


@pytest.mark.parametrize("views", [0, -1, 5000])
def test_impossible_view_counts_are_named(views: int) -> None:
    profile = DisplayProfile.load("gavane-2024-tilted-4k")
    for ask in (profile.view_index_map, profile.rig):
        with pytest.raises(UsageError, match=f"views is {views}"):
            ask(views)


# -- JSON Schema -------------------------------------------------------------------------------


def test_published_schema_is_the_models() -> None:
    path = REPOSITORY / "docs" / "display-profile.schema.json"
    expected = json.dumps(DisplayProfile.json_schema(), indent=2) + "\n"
    assert path.read_text(encoding="utf-8") == expected, "write json_schema() to the file again"


@pytest.mark.parametrize("name", shipped_profiles())
def test_shipped_profiles_fit_the_schema_and_their_names(name: str) -> None:
    profile = DisplayProfile.load(name)
    jsonschema.Draft202012Validator(DisplayProfile.json_schema()).validate(
        json.loads(profile.to_json())
    )
    assert profile.name == name
    assert profile.template


@pytest.mark.parametrize(
    ("field", "value"),
    # What relates two fields and what JSON cannot say is the loader's to refuse.
    [(f, v) for f, v, _ in BAD_FIELDS if f != "panel.resolution_px" and str(v) != "nan"],
)
def test_the_schema_refuses_what_the_model_refuses(field: str, value: Any) -> None:
    validator = jsonschema.Draft202012Validator(DisplayProfile.json_schema())
    assert not validator.is_valid(with_field(field, value))

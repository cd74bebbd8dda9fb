"""Many random profiles: saved, converted there and back, and spoilt."""

import json
import re
from collections.abc import Callable

import numpy as np
import pytest

from lfd_render.display import DisplayProfile
from lfd_render.display.convert import WRITERS, convert, differences, views_apart
from lfd_render.display.model import Stripes
from lfd_render.errors import ProfileError

from .wild_profiles import mutated, profile_data

FULL, REDUCED = 100_000, 2000

# Fields that a format has no room for, whatever they are; and where it has none of the picture's.
LOST = {
    "profile": (),
    "looking-glass": (
        "name", "serial", "date", "response", "correction", "provenance", "uncertainty",
        "panel.size_mm", "panel.subpixels", "panel.mount", "lens.index", "lens.gap_mm",
        "lens.center", "viewing.views", "viewing.distance_mm", "viewing.spacing",
    ),
    "van-berkel": (),
    "physical": (),
    "leia": (),
}  # fmt: skip


def refusal(profile: DisplayProfile, name: str) -> str | None:
    """Why a format has no file of a profile."""
    subpixels = profile.panel.subpixels
    if name == "looking-glass" and profile.drift == 0:
        return "lens.drift is 0"
    if name in ("van-berkel", "leia") and (
        not isinstance(subpixels, Stripes) or subpixels.axis == "up"
    ):
        return "panel.subpixels"
    return None


@pytest.mark.shows("random profiles come back equal from a file")
def test_saved_profiles_come_back_equal(scaled: Callable[[int, int], int]) -> None:
    rng = np.random.default_rng(11)
    for _ in range(scaled(FULL, REDUCED)):
        text = json.dumps(profile_data(rng))
        profile = DisplayProfile.from_json(text)
        again = DisplayProfile.from_json(profile.to_json())
        assert again == profile
        assert again.hash == profile.hash
        assert not list(differences(profile, again))


@pytest.mark.shows("random profiles come back equal from other formats where these hold them")
def test_conversions_there_and_back(scaled: Callable[[int, int], int]) -> None:
    rng = np.random.default_rng(12)
    formats = [name for name in LOST if name != "profile"]
    done = dict.fromkeys(formats, 0)
    for n in range(scaled(FULL, REDUCED)):
        name = formats[n % len(formats)]
        data = profile_data(rng)
        if name == "physical":
            data["lens"].setdefault("gap_mm", 1.5)
        profile = DisplayProfile.from_json(json.dumps(data))
        if reason := refusal(profile, name):
            with pytest.raises(ProfileError, match=reason):
                convert(profile, name)
            continue
        conversion = convert(profile, name)
        done[name] += 1
        for lost in conversion.lost:
            assert lost.field.startswith(LOST[name]), (name, lost)
        if not conversion.lost:
            assert conversion.read_back == profile
        # Once lost nothing more is: what the format holds it holds to the bit.
        again = convert(conversion.read_back, name)
        assert again.read_back == conversion.read_back
        assert again.text == conversion.text
        plain = profile.correction is None
        # Centres of a thousand lenses have 2⁻⁴³ of a lens to themselves.
        if n % 10 == 0 and plain:
            apart = views_apart(profile, conversion.read_back)
            assert apart is not None
            assert apart / profile.views < 1e-9 or "panel.size_mm" in str(conversion.lost)
    assert min(done.values()) > 0.3 * sum(done.values()) / len(done)


@pytest.mark.shows("spoilt profiles are refused by the name of the field")
def test_spoilt_profiles_name_the_field(scaled: Callable[[int, int], int]) -> None:
    rng = np.random.default_rng(13)
    for _ in range(scaled(FULL, REDUCED)):
        data, field = mutated(rng, profile_data(rng))
        with pytest.raises(ProfileError) as error:
            DisplayProfile.from_json(json.dumps(data), source="p.json")
        assert field in str(error.value), (field, str(error.value))
        assert str(error.value).startswith("p.json: ")
        assert "\n" not in str(error.value)
        assert len(str(error.value)) < 400


SPOILERS = (
    "NaN",
    "-1",
    "1e999",
    "null",
    "{}",
    "[]",
    "0",
    '"x"',
    "true",
    "",
    "9" * 400,
    "-0",
    "1e-300",
)


@pytest.mark.parametrize("name", WRITERS)
def test_spoilt_texts_of_any_format_are_read_or_refused(
    name: str, scaled: Callable[[int, int], int]
) -> None:
    """One number, text or bracket replaced: a profile or a ProfileError, and nothing else."""
    rng = np.random.default_rng(14)
    refused = 0
    for _ in range(scaled(1000, 30)):
        data = profile_data(rng)
        data["lens"] |= {"gap_mm": 1.0, "drift": 0.1}
        data["panel"]["subpixels"] = {"layout": "stripe"}
        text = convert(DisplayProfile.from_json(json.dumps(data)), name).text
        spots = list(re.finditer(r'-?\d+\.?\d*(e[+-]?\d+)?|"[^"]*"|[\[\]{},]', text))
        for _ in range(8):
            start, end = spots[int(rng.integers(len(spots)))].span()
            spoilt = text[:start] + SPOILERS[int(rng.integers(len(SPOILERS)))] + text[end:]
            try:
                DisplayProfile.from_json(spoilt, "p")
            except ProfileError:
                refused += 1
    assert refused > 4 * scaled(1000, 30) * 0.5


def test_every_format_is_tried() -> None:
    assert {*LOST, "3d-global"} == set(WRITERS)


@pytest.mark.parametrize(("name", "field"), [("van-berkel", "tan_alpha"), ("leia", "m_y")])
def test_a_center_beyond_all_digits_is_refused(name: str, field: str) -> None:
    """It came out of numbers that each may be so large, and had no place for its digits."""
    data = json.loads(convert(DisplayProfile.load("looking-glass-portrait-sample-a"), name).text)
    data["numbers"][field] = 9e11
    for key in ("subpixels_per_lens", "m_x", "m_c"):
        if key in data["numbers"]:
            data["numbers"][key] *= 1e-9
    with pytest.raises(ProfileError):
        DisplayProfile.from_json(json.dumps(data), "p")

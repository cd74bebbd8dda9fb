"""`lfd-render display …`: what each command prints and writes, and how it fails."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from lfd_render.display import DisplayProfile, shipped_profiles
from lfd_render.display.mount import stored

from .conftest import Command

A, B = "looking-glass-portrait-sample-a", "looking-glass-portrait-sample-b"


def test_list_names_shipped_and_mounted_displays(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("LFD_CALIBRATION_ROOTS", str(tmp_path))
    assert command("display", "list").stdout.count("\n") == len(shipped_profiles())
    folder = tmp_path / "LKG_calibration"
    folder.mkdir()
    calibration = folder / "visual.json"
    made = command("display", "convert", A, "--to", "looking-glass", "-o", calibration)
    assert made.code == 0
    result = command("display", "list", "--json")
    mounted = [entry for entry in result.json["displays"] if entry["kind"] == "mounted"]
    assert [entry["display"] for entry in mounted] == [str(calibration)]
    assert not mounted[0]["template"]
    assert command("display", "show", "auto", "--json").json["lens_count"] == pytest.approx(
        246.971361
    )
    calibration.write_text("{}")
    broken = command("display", "list", "--search", tmp_path)
    assert broken.code == 0
    assert "visual.json  cannot be read" in broken.stdout
    assert "warning" in broken.stderr


def test_show_says_figures_and_draws(command: Command, display: Path, tmp_path: Path) -> None:
    text = command("display", "show", display)
    assert "lens_leans_going_up      right" in text.stdout
    assert "lens_count               24.3" in text.stdout
    drawn = command("display", "show", display, "--picture", tmp_path / "a.png", "--json")
    assert drawn.json["views_per_subpixel"] == pytest.approx(8 * 24.3 / (3 * 192))
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.size[0] > 500
    bad = command("display", "show", display, "--views", "continuous")
    assert (bad.code, bad.stdout) == (2, "")


def test_validate_names_what_is_wrong(command: Command, display: Path, tmp_path: Path) -> None:
    good = command("display", "validate", display)
    assert good.code == 0
    assert good.stdout == f"{display}: valid, {DisplayProfile.load(display).hash}\n"
    bad = tmp_path / "bad.json"
    bad.write_text(display.read_text().replace("24.3", "NaN"))
    result = command("display", "validate", display, bad, "--json")
    assert result.code == 4
    assert "lens.lens_count is nan" in result.error
    assert [entry["valid"] for entry in result.json["displays"]] == [True, False]
    doubtful = tmp_path / "doubtful.json"
    doubtful.write_text(display.read_text().replace("400.0", "0.4"))
    found = command("display", "validate", doubtful, "--json").json["displays"][0]
    assert "in metres it would be 400 mm" in found["warnings"][0]


@pytest.mark.parametrize("to", ["profile", "looking-glass", "van-berkel", "leia", "3d-global"])
def test_convert_tells_what_is_lost(
    command: Command, display: Path, tmp_path: Path, to: str
) -> None:
    file = tmp_path / "other"
    result = command("display", "convert", display, "--to", to, "-o", file, "--json")
    assert result.code == 0
    back, profile = DisplayProfile.load(file), DisplayProfile.load(display)
    lost = {entry["field"] for entry in result.json["lost"]}
    assert (back == profile) == (not lost)
    assert lost == {"profile": set(), "van-berkel": set(), "leia": set()}.get(to, lost)
    if to == "3d-global":
        assert "lens.lens_count" in lost
        assert result.json["views_apart"] > 0.1
        assert "the picture of what comes back differs" in result.stderr
        assert "cannot hold lens.lens_count: 24.3 comes back as" in result.stderr
    else:
        assert result.json["views_apart"] < 1e-6
    assert command("display", "convert", display, "--to", to).stdout == file.read_text() or (
        to == "3d-global"  # whose text ends in an empty line
    )


def test_convert_refuses(command: Command, display: Path, tmp_path: Path) -> None:
    assert "unknown; use profile" in command("display", "convert", display, "--to", "x").error
    physical = command("display", "convert", display, "--to", "physical", "-o", tmp_path / "a")
    assert physical.code == 4
    assert "lens.gap_mm is missing" in physical.error
    assert list(tmp_path.iterdir()) == []
    assert command("display", "convert", display, "--to", "leia", "--json").code == 2
    assert command("display", "convert", display, "--to", "leia", "-o", tmp_path).code == 8
    assert command("display").code == 2


def test_diff_tells_views_over_the_panel(command: Command, tmp_path: Path) -> None:
    result = command("display", "diff", A, B, "--json", "--picture", tmp_path / "d.png").json
    assert result["corner_views"]["top_left"] == pytest.approx(-11.19, abs=0.01)
    assert result["max_views"] == pytest.approx(11.19, abs=0.01)
    fields = {entry["field"] for entry in result["fields"]}
    assert {"lens.lens_count", "lens.drift", "lens.center"} <= fields
    assert "panel.size_mm" not in fields
    assert (tmp_path / "d.png").is_file()
    text = command("display", "diff", A, B).stdout
    assert "top left -11.188" in text
    assert "lens.center: 0.40277 or 0.4017" in text
    assert command("display", "diff", A, "gavane-2024-tilted-4k").code == 4


def test_map_writes_the_view_of_each_subpixel(
    command: Command, display: Path, tmp_path: Path
) -> None:
    turned = json.loads(display.read_text())
    turned["panel"]["mount"] = {"rotation_deg": 90}
    file = tmp_path / "turned.json"
    file.write_text(json.dumps(turned))
    profile = DisplayProfile.load(file)
    expected = stored(profile.view_index_map(8), profile.panel.mount)
    assert command("display", "map", file, "-o", tmp_path / "m.npy").code == 0
    np.testing.assert_array_equal(np.load(tmp_path / "m.npy"), expected)
    result = command("display", "map", file, "-o", tmp_path / "m.png", "--json")
    assert result.json["shape"] == [192, 108, 3]
    with Image.open(tmp_path / "m.png") as picture:
        np.testing.assert_array_equal(np.asarray(picture), expected)
    many = command("display", "map", file, "-o", tmp_path / "n.png", "--views", "300")
    assert many.code == 2
    assert "give a name in .npy" in many.error

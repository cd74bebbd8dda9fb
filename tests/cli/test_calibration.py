"""`display pattern`, `fit` and `calibrate`, and the tutorial that leads through them."""

import io
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lfd_render.display import DisplayProfile
from lfd_render.display.patterns import view_grating
from lfd_render.panel.picture import read_picture

from ..photographs import Panel
from .conftest import Command

REPOSITORY = Path(__file__).resolve().parents[2]
TUTORIAL = (REPOSITORY / "docs" / "calibration.md").read_text(encoding="utf-8")


def test_the_tutorial_ends_at_a_profile(tmp_path: Path) -> None:
    blocks = re.findall(r"```(sh|json)\n(.*?)```", TUTORIAL, re.DOTALL)
    (guess,) = (text for language, text in blocks if language == "json")
    (tmp_path / "guess.json").write_text(guess, encoding="utf-8")
    (tmp_path / "tests").symlink_to(REPOSITORY / "tests")
    python = f'"{sys.executable}"'
    script = f'set -e\nlfd-render() {{ {python} -m lfd_render.cli.main "$@"; }}\n'
    script += f'python() {{ {python} "$@"; }}\n'
    script += "".join(text for language, text in blocks if language == "sh")
    done = subprocess.run(
        ["bash", "-c", script], cwd=tmp_path, capture_output=True, text=True, check=False,
        env=os.environ | {"PYTHONPATH": str(REPOSITORY)},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    count, drift, center = Panel().seen(600)
    for name in ("panel", "panel-with-gap"):
        profile = DisplayProfile.load(tmp_path / f"{name}.json")
        assert not profile.template
        assert profile.provenance.assumed == ()
        assert profile.lens_count == pytest.approx(count, abs=0.002)
        assert profile.drift == pytest.approx(drift, abs=2e-5)
        assert abs((profile.center - center + 0.5) % 1 - 0.5) * 48 < 0.05
    assert profile.lens.gap_mm == pytest.approx(1.53, abs=0.03)
    # Before the photographs it was off by more than any of these.
    eye = DisplayProfile.load(tmp_path / "eye.json")
    assert abs(eye.lens_count - count) > 0.01
    assert read_picture(tmp_path / "residual.png").any()


@pytest.fixture
def guess(tmp_path: Path) -> Path:
    (text,) = re.findall(r"```json\n(.*?)```", TUTORIAL, re.DOTALL)
    data: dict[str, Any] = json.loads(text)
    data["panel"] |= {"resolution_px": [96, 54]}
    data["lens"]["lens_count"] = 12.0
    path = tmp_path / "guess.json"
    path.write_text(json.dumps(data), encoding="utf-8")
    return path


def test_patterns_are_the_panels_pixels(command: Command, guess: Path, tmp_path: Path) -> None:
    profile = DisplayProfile.load(guess)
    file = tmp_path / "p.png"
    result = command(
        "display", "pattern", "grating", "--display", guess, "-o", file,
        "--view", 5, "--colour", "blue", "--json",
    )  # fmt: skip
    assert result.code == 0
    assert result.json == {"output": [str(file)], "display": "my-panel", "kind": "grating"}
    picture = read_picture(file)
    lit = profile.view_index_map() == 5
    lit[..., :2] = False
    assert np.array_equal(picture, np.where(lit, 255, 0))
    for kind in ("numbers", "pitch-ruler", "tilt-ruler", "crosstalk", "white"):
        result = command("display", "pattern", kind, "--display", guess, "-o", file)
        assert result.code == 0, result.stderr
        assert read_picture(file).shape == (54, 96, 3)
    folder = tmp_path / "set"
    result = command(
        "display", "pattern", "phases", "--display", guess, "-o", folder,
        "--steps", 3, "--colour", "green",
    )  # fmt: skip
    assert result.code == 0
    names = {path.name for path in folder.iterdir()}
    assert names == {"white.png"} | {f"green{h}_{s}of3.png" for h in ("", "_h3") for s in range(3)}


def test_patterns_lie_as_the_panel_takes_them(
    command: Command, guess: Path, tmp_path: Path
) -> None:
    data = json.loads(guess.read_text(encoding="utf-8"))
    turned, file = tmp_path / "turned.json", tmp_path / "p.png"
    data["panel"]["mount"] = {"rotation_deg": 90, "flip_x": True}
    turned.write_text(json.dumps(data), encoding="utf-8")
    lit = view_grating(DisplayProfile.load(guess))
    assert command("display", "pattern", "grating", "--display", turned, "-o", file).code == 0
    assert np.array_equal(read_picture(file), np.rot90(lit[:, ::-1]))


@pytest.mark.parametrize(
    ("options", "code", "text"),
    [
        (["white", "--view", 3], 2, "--view: goes with grating, not with white"),
        (["numbers", "--steps", 3], 2, "--steps: goes with phases, not with numbers"),
        (["phases", "--steps", 2], 2, "steps: 2 is out of range; use 3 to 32"),
        (["grating", "--view", 48], 2, "view: 48 is out of range; 'my-panel' has 0 to 47"),
    ],
)
def test_pattern_options_that_make_no_sense(
    command: Command, guess: Path, tmp_path: Path, options: list[Any], code: int, text: str
) -> None:
    output = tmp_path / ("folder" if options[0] == "phases" else "p.png")
    result = command("display", "pattern", *options, "--display", guess, "-o", output)
    assert result.code == code
    assert text in result.error
    assert not output.exists()


@pytest.mark.parametrize(
    ("options", "code", "text"),
    [
        ([], 7, "0 photographs have names of steps"),
        (["--corners", "1,2 3,4"], 2, "give four points"),
        (["--corners", "1,2 3;4 5,6 7,8"], 2, "--corners: '3;4'; give two numbers as 12.5,-3"),
        (["--distance", 600, "--distance", 900], 2, "--distance: given 2 times for 1 folders"),
        (["--distance", -5], 2, "-5"),
        (["--camera-offset", "1"], 2, "--camera-offset: '1'; give two numbers"),
        (["--residual", "r.txt"], 2, "r.txt: suffix '.txt'"),
    ],
)
def test_fit_options_that_make_no_sense(
    command: Command, guess: Path, tmp_path: Path, options: list[Any], code: int, text: str
) -> None:
    photos, output = tmp_path / "photos", tmp_path / "out.json"
    photos.mkdir()
    result = command("display", "fit", photos, "--display", guess, "-o", output, *options)
    assert result.code == code
    assert text in result.error
    assert not output.exists()


def test_photographs_that_are_none(command: Command, guess: Path, tmp_path: Path) -> None:
    photos, output = tmp_path / "photos", tmp_path / "out.json"
    fit = ("display", "fit", photos, "--display", guess, "-o", output)
    assert "photos: is no folder" in command(*fit).error
    patterns = tmp_path / "patterns"
    command("display", "pattern", "phases", "--display", guess, "-o", patterns, "--colour", "red")
    shutil.copytree(patterns, photos)
    (photos / "red_1of4.png").write_text("not a picture", encoding="utf-8")
    result = command(*fit, "--corners", "2,2 94,2 94,52 2,52")
    assert result.code == 7
    assert "red_1of4.png: is not a picture of a known kind" in result.error
    shutil.copy(patterns / "red_0of4.png", photos / "red_0of4.jpg")
    result = command(*fit)
    assert "red_0of4.png: is there as red_0of4.jpg too" in result.error
    assert "two folders need" in command("display", "fit", photos, photos, *fit[3:]).error
    assert not output.exists()


def calibrated(
    command: Command, monkeypatch: pytest.MonkeyPatch, guess: Path, folder: Path, answers: str
) -> Any:
    monkeypatch.setattr(sys, "stdin", io.StringIO(answers))
    return command(
        "display", "calibrate", "--display", guess, "-o", folder / "eye.json",
        "--pattern", folder / "pattern.png",
    )  # fmt: skip


def test_the_guide_adjusts_count_tilt_and_center(
    command: Command, monkeypatch: pytest.MonkeyPatch, guess: Path, tmp_path: Path
) -> None:
    answers = "+0.5\nr\nr\nnonsense\n=9999\n\n=9.66\nb\n-0.1\n\n\n+0.25\n\n"
    result = calibrated(command, monkeypatch, guess, tmp_path, answers)
    assert result.code == 0, result.stderr
    assert "'nonsense' is no answer" in result.stderr
    assert "lens_count 9999" in result.stderr
    was, profile = DisplayProfile.load(guess), DisplayProfile.load(tmp_path / "eye.json")
    assert profile.lens_count == pytest.approx(12.4)
    assert np.degrees(profile.tilt_rad) == pytest.approx(9.66)
    assert profile.name == "my-panel-by-eye"
    assert profile.provenance.assumed == ()

    def middle(p: DisplayProfile) -> float:
        return p.lens_count * (1 + p.drift) / 2 - p.center

    # Count and tilt turn about the panel's middle; only the center's own step moves it.
    assert (middle(was) - middle(profile)) % 1 == pytest.approx(0.25)
    assert read_picture(tmp_path / "pattern.png").shape == (54, 96, 3)


@pytest.mark.parametrize(
    ("answers", "text"),
    [("+1\n\n", "the answers end before the last step"), ("q\n", "ended before the last step")],
)
def test_a_guide_that_ends_early_writes_no_profile(
    command: Command,
    monkeypatch: pytest.MonkeyPatch,
    guess: Path,
    tmp_path: Path,
    answers: str,
    text: str,
) -> None:
    result = calibrated(command, monkeypatch, guess, tmp_path, answers)
    assert result.code == 2
    assert text in result.stderr
    assert not (tmp_path / "eye.json").exists()

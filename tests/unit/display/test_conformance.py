"""The published golden maps: numpy gives each, and neither of the two known mistakes."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lfd_render.display import DisplayProfile
from lfd_render.display.mount import seen, stored

SUITE = Path(__file__).resolve().parents[3] / "docs" / "conformance"
CASES = sorted(path.stem for path in (SUITE / "cases").glob("*.json"))


def read_case(name: str, folder: str = "cases") -> tuple[DisplayProfile, int, np.ndarray]:
    """Profile, number of views and map [y, x, channel] of a file."""
    case: dict[str, Any] = json.loads((SUITE / folder / f"{name}.json").read_text("utf-8"))
    told = case["input"]
    text = told if isinstance(told, str) else json.dumps(told)
    views = np.array(case["map"], np.uint16)
    return DisplayProfile.from_json(text, name), case["views"], views.reshape(len(views), -1, 3)


@pytest.mark.shows("the conformance suite's maps, in numpy")
@pytest.mark.parametrize("name", CASES)
def test_numpy_gives_the_golden_map(name: str) -> None:
    profile, views, expected = read_case(name)
    index = stored(profile.view_index_map(views), profile.panel.mount)
    np.testing.assert_array_equal(index, expected)
    np.testing.assert_array_equal(seen(index, profile.panel.mount), profile.view_index_map(views))


@pytest.mark.shows("the two known mistakes are refused")
@pytest.mark.parametrize("name", ["over-width-less-one", "without-half-pixel"])
def test_known_mistakes_are_refused(name: str) -> None:
    profile, views, wrong = read_case(name, "controls")
    index = profile.view_index_map(views)
    assert index.shape == wrong.shape
    assert np.count_nonzero(index != wrong) > 0.5 * index.size


def test_the_suite_is_what_its_script_writes() -> None:
    """The script imports nothing of the project, and the files are as it writes them."""
    script = SUITE / "generate.py"
    assert "lfd_render" not in script.read_text("utf-8")
    done = subprocess.run(
        [sys.executable, "-I", str(script), "--check"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout
    assert f"{len(CASES) + 2} files" in done.stdout


def test_every_formula_mode_flip_and_sign_has_a_case() -> None:
    kinds = (
        *(f"cells-mode-{mode}" for mode in range(5)), "stripe-lean-left", "stripe-lean-right",
        "stripe-lean-upright", "stripe-bgr", "inverted", "correction", "mount-90", "mount-0-flip-x",
        "mount-0-flip-y", "visual-json-flip-x", "visual-json-flip-subp", "visual-json-cells",
        "van-berkel", "physical", "leia", "3d-global",
    )  # fmt: skip
    assert all(any(name.startswith(kind) for name in CASES) for kind in kinds)

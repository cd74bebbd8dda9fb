"""`lfd-render compare`: known answers, difference pictures, frames, and pairs that do not fit."""

import sys
from pathlib import Path

import numpy as np
import pytest

from lfd_render.panel.formats import write_exr
from lfd_render.panel.picture import read_picture, write_png
from lfd_render.reference.textures import linear_from_srgb

from .conftest import Command

SIZE = (24, 32)


@pytest.fixture
def pictures(tmp_path: Path, rng: np.random.Generator) -> tuple[Path, Path]:
    """Two pictures, six levels apart in red on the left half."""
    first = rng.integers(20, 180, (*SIZE, 3), dtype=np.uint8)
    second = first.copy()
    second[:, :16, 0] += 6
    for name, pixels in (("a", first), ("b", second)):
        write_png(tmp_path / f"{name}.png", pixels)
    return tmp_path / "a.png", tmp_path / "b.png"


def test_a_known_difference(command: Command, pictures: tuple[Path, Path], tmp_path: Path) -> None:
    shown = tmp_path / "d.png"
    result = command("compare", *pictures, "--difference", shown, "--json")
    assert result.code == 0
    assert result.json["rmse"] == pytest.approx(6 / np.sqrt(6))
    assert result.json["psnr"] == pytest.approx(20 * np.log10(255 / (6 / np.sqrt(6))))
    assert 0.9 < result.json["ssim"] < 1.0
    assert 0.0 < result.json["flip"] < 0.2
    assert result.json["largest_difference"] == 6
    expected = np.zeros((*SIZE, 3), np.uint8)
    expected[:, :16, 0] = 255  # the largest difference is white
    np.testing.assert_array_equal(read_picture(shown), expected)


def test_equal_pictures_and_the_chosen_metrics(
    command: Command, pictures: tuple[Path, Path]
) -> None:
    result = command("compare", pictures[0], pictures[0], "--metric", "psnr", "--metric", "rmse")
    assert result.stdout.split() == ["psnr", "inf", "dB", "rmse", "0"]
    result = command("compare", pictures[0], pictures[0], "--metric", "psnr", "--json")
    assert result.json["psnr"] is None
    assert "rmse" not in result.json


def test_the_map_of_flip_tells_where(
    command: Command, pictures: tuple[Path, Path], tmp_path: Path
) -> None:
    shown = tmp_path / "d.png"
    assert command("compare", *pictures, "--difference", shown, "--show", "flip").code == 0
    found = read_picture(shown).astype(int).sum(axis=-1)
    assert found[:, :12].mean() > 5 * (found[:, 22:].mean() + 1)


def test_an_exr_is_what_it_is_shown_as(
    command: Command, pictures: tuple[Path, Path], tmp_path: Path
) -> None:
    codes = read_picture(pictures[0])
    write_exr(tmp_path / "a.exr", linear_from_srgb(codes / 255.0).astype(np.float16), {})
    result = command("compare", pictures[0], tmp_path / "a.exr", "--json")
    assert result.json["largest_difference"] <= 1  # half floats


def frames(folder: Path, count: int, lift: int = 0) -> Path:
    folder.mkdir()
    for index in range(count):
        pixels = np.full((*SIZE, 3), 100 + index + lift, np.uint8)
        write_png(folder / f"frame_{index:03d}.png", pixels)
    return folder


def test_folders_of_frames(command: Command, tmp_path: Path) -> None:
    first, second = frames(tmp_path / "a", 3), frames(tmp_path / "b", 3, lift=2)
    shown = tmp_path / "d"
    result = command("compare", first, second, "--metric", "rmse", "--difference", shown, "--json")
    assert result.json["rmse"] == pytest.approx(2)
    assert result.json["frames"] == 3
    assert sorted(f.name for f in shown.iterdir()) == [f"frame_{i:03d}.png" for i in range(3)]


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ("size", "pictures are 32 x 24 and 31 x 24 pixels; they should be of one size"),
        ("missing", "no.png: cannot be read: No such file"),
        ("kind", "is a folder and"),
        ("frames", "lacks frame_002.png, which"),
        ("empty", "holds no pictures"),
        ("text", "is not a picture of a known kind"),
    ],
)
def test_pairs_that_do_not_fit(
    command: Command, pictures: tuple[Path, Path], tmp_path: Path, fault: str, message: str
) -> None:
    first, second = pictures
    if fault == "size":
        write_png(second, read_picture(second)[:, 1:])
    elif fault == "missing":
        second = tmp_path / "no.png"
    elif fault == "kind":
        second = tmp_path
    elif fault == "frames":
        first, second = frames(tmp_path / "c", 3), frames(tmp_path / "d", 2)
    elif fault == "empty":
        first, second = frames(tmp_path / "c", 1), frames(tmp_path / "d", 0)
    else:
        second.write_text("not a picture")
    shown = tmp_path / "shown.png" if first.is_file() else tmp_path / "shown"
    result = command("compare", first, second, "--difference", shown)
    assert result.code == 7
    assert message in result.error
    assert not shown.exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--pixels-per-degree", 0), "--pixels-per-degree: 0.0; give a number above 0"),
        (("--fps", "nan"), "--fps: nan; give a number above 0"),
        (("--metric", "mse"), "mse"),
    ],
)
def test_bad_options_are_named(
    command: Command, pictures: tuple[Path, Path], arguments: tuple, message: str
) -> None:
    result = command("compare", *pictures, *arguments)
    assert result.code == 2
    assert message in result.error


def test_the_missing_video_metric_is_named(
    command: Command, pictures: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pycvvdp", None)
    result = command("compare", *pictures, "--metric", "cvvdp")
    assert result.code == 2
    assert "install lfd-render[cvvdp]" in result.error

"""`lfd-render quilt`, `weave` and `unweave`: names, files, warnings; pictures by a fake."""

import io
import json
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from lfd_render.display import DisplayProfile
from lfd_render.panel.picture import read_picture, read_png_text, write_png
from lfd_render.panel.quilt import PRESETS, Quilt
from lfd_render.panel.unweave import unweave
from lfd_render.panel.view_folder import write_views

from .conftest import PANEL, VIEWS, Command, FakeRenderer

pytestmark = pytest.mark.usefixtures("renderer")


@pytest.fixture
def noise(tmp_path: Path, display: Path) -> Path:
    """A panel image of the small display, with the metadata of one."""
    rng = np.random.default_rng(4)
    pixels = rng.integers(0, 256, (PANEL[1], PANEL[0], 3), dtype=np.uint8)
    profile = DisplayProfile.load(display)
    text = {"lfd:profile": profile.name, "lfd:profile-hash": profile.hash, "lfd:views": "8"}
    write_png(tmp_path / "noise.png", pixels, text)
    return tmp_path / "noise.png"


# ---- quilt ------------------------------------------------------------------------------------


def test_a_quilt_says_its_tiling_in_its_name(
    command: Command, renderer: FakeRenderer, scene: Path, display: Path, tmp_path: Path
) -> None:
    result = command(
        "quilt", scene, "-o", tmp_path / "a", "-d", display, "--tiles", "4x2", "--size", "96x28",
        "--seed", 5, "--json",
    )  # fmt: skip
    path = tmp_path / "a_qs4x2a1.77778.png"
    found = result.json
    assert found["output"] == str(path)
    assert (found["tiles"], found["size"], found["view_size"]) == ([4, 2], [96, 28], [24, 14])
    assert (renderer.calls[0]["views"], renderer.calls[0]["view_size"]) == (8, (24, 14))
    assert renderer.calls[0]["seed"] == 5
    quilt = Quilt.load(path)
    assert quilt.aspect == 96 / 54
    assert [int(view[0, 0, 0]) for view in quilt.views] == list(range(8))
    assert read_picture(path)[::14, ::24, 0].tolist() == [[4, 5, 6, 7], [0, 1, 2, 3]]
    assert read_png_text(path)["lfd:profile"] == "small"


def test_the_display_s_own_views_are_tiled_by_default(
    command: Command, renderer: FakeRenderer, scene: Path, display: Path, tmp_path: Path
) -> None:
    # The fake gives views of 24 × 14, the display's own are of 192·108/(8·104) = 25 by 104.
    result = command("quilt", scene, "-o", tmp_path / "a", "-d", display)
    assert renderer.calls[0]["views"] == VIEWS
    width, height = renderer.calls[0]["view_size"]
    assert width * height == pytest.approx(192 * 108 / 8, rel=0.02)
    assert "pixels do not hold" in result.error


@pytest.mark.parametrize("name", PRESETS)
def test_presets_by_device(
    command: Command, renderer: FakeRenderer, scene: Path, display: Path, tmp_path: Path, name: str
) -> None:
    renderer.error = RuntimeError("asked")
    command("quilt", scene, "-o", tmp_path / "a", "-d", display, "--quilt", name)
    assert renderer.calls[0]["views"] == PRESETS[name].views
    assert renderer.calls[0]["view_size"] == PRESETS[name].view_px
    assert list(tmp_path.iterdir()) == []


def test_a_quilt_goes_to_stdout(
    command: Command, scene: Path, display: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stdout = io.TextIOWrapper(io.BytesIO())
    monkeypatch.setattr(sys, "stdout", stdout)
    arguments = ("-d", display, "--tiles", "4x2", "--size", "96x28")
    assert command("quilt", scene, "-o", "-", *arguments).code == 0
    stdout.seek(0)
    (tmp_path / "a.png").write_bytes(stdout.buffer.read())
    assert Quilt.load(tmp_path / "a.png").views.shape == (8, 14, 24, 3)


# ---- weave ------------------------------------------------------------------------------------


def test_a_quilt_becomes_a_panel_image(
    command: Command, renderer: FakeRenderer, display: Path, tmp_path: Path
) -> None:
    views = np.random.default_rng(1).integers(0, 256, (8, 14, 24, 3), dtype=np.uint8)
    path = Quilt(views, 4, 2, 16 / 9).save(tmp_path / "q")
    out = tmp_path / "eia.png"
    result = command("weave", path, "-o", out, "-d", display, "--json")
    call = renderer.calls[0]
    np.testing.assert_array_equal(call["views"].views, views)
    rule = {name: call[name] for name in ("lookup", "weave", "aa", "aa_light")}
    assert rule == {"lookup": "lens", "weave": "nearest", "aa": "none", "aa_light": "linear"}
    assert read_picture(out).shape == (PANEL[1], PANEL[0], 3)
    assert (result.json["views"], result.json["warnings"]) == (8, [])
    assert list(result.json["timings_ms"]) == ["load", "weave", "encode", "total"]
    chosen = ("--lookup", "subpixel", "--aa", "both", "--aa-light", "encoded")
    assert command("weave", path, "-o", out, "-d", display, *chosen).code == 0
    assert renderer.calls[1]["lookup"] == "subpixel"
    assert (renderer.calls[1]["aa"], renderer.calls[1]["aa_light"]) == ("both", "encoded")
    assert command("weave", path, "-o", tmp_path / "eia.exr", "-d", display).code == 0
    assert (tmp_path / "eia.exr").read_bytes()[:4] == b"\x76\x2f\x31\x01"


def test_explicit_tiles_win(
    command: Command, renderer: FakeRenderer, display: Path, tmp_path: Path
) -> None:
    write_png(tmp_path / "q.png", np.zeros((28, 96, 3), np.uint8))
    arguments = ("weave", tmp_path / "q.png", "-o", tmp_path / "a.png", "-d", display)
    refused = command(*arguments)
    assert (refused.code, renderer.calls) == (7, [])
    assert "says nowhere how it is tiled" in refused.error
    assert command(*arguments, "--tiles", "4x2").code == 0
    assert renderer.calls[0]["views"].views.shape == (8, 14, 24, 3)


def test_what_a_person_should_know_of_a_quilt(
    command: Command, display: Path, tmp_path: Path
) -> None:
    path = tmp_path / "q_qs4x2a1.2.jpg"
    Image.fromarray(np.zeros((28, 96, 3), np.uint8)).save(path)
    result = command("weave", path, "-o", tmp_path / "a.png", "-d", display, "--json")
    jpeg, aspect = result.json["warnings"]
    assert "chroma subsampling" in jpeg
    assert "aspect 1.2, the display 'small' 1.778; they are stretched" in aspect
    assert all(warning in result.stderr for warning in (jpeg, aspect))


def test_a_quilt_whose_name_disagrees_with_its_pixels(
    command: Command, display: Path, tmp_path: Path
) -> None:
    write_png(tmp_path / "q_qs5x9a1.78.png", np.zeros((28, 96, 3), np.uint8))
    result = command(
        "weave", tmp_path / "q_qs5x9a1.78.png", "-o", tmp_path / "a.png", "-d", display
    )
    assert result.code == 7
    assert "96 x 28 pixels do not divide into 5 x 9 views" in result.error


# ---- unweave ----------------------------------------------------------------------------------


def test_unwoven_views_are_a_folder_that_weaves(
    command: Command, renderer: FakeRenderer, noise: Path, display: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "views"
    found = command("unweave", noise, "-o", folder, "-d", display, "--json").json
    names = [f"view_{index:03d}.png" for index in range(8)]
    assert found["output"] == [str(folder / name) for name in names]
    assert (found["views"], found["collisions"], found["warnings"]) == (8, 0, [])
    assert sorted(file.name for file in folder.iterdir()) == [*names, "views.json"]
    assert read_picture(folder / names[3]).shape == (*found["view_size"][::-1], 3)
    expected = unweave(read_picture(noise), DisplayProfile.load(display), 8)
    assert command("weave", folder, "-o", tmp_path / "a.png", "-d", display).code == 0
    given = renderer.calls[0]["views"]
    np.testing.assert_array_equal(given.views, expected.views)
    np.testing.assert_array_equal(given.grid.row_base, expected.grid.row_base)


def test_the_file_s_own_rows_are_taken_where_they_weave_back(
    command: Command, noise: Path, display: Path, tmp_path: Path
) -> None:
    profile = DisplayProfile.load(display)
    text = read_png_text(noise) | {"lfd:view-grid": "lens", "lfd:view-size": "26x12"}
    flat = np.full((PANEL[1], PANEL[0], 3), 90, np.uint8)
    arguments = ("-o", tmp_path / "views", "-d", display, "--json")
    write_png(tmp_path / "flat.png", flat, text)
    assert command("unweave", tmp_path / "flat.png", *arguments).json["view_size"][1] == 12
    write_png(tmp_path / "other.png", read_picture(noise), text)
    found = command("unweave", tmp_path / "other.png", *arguments).json
    assert found["view_size"][1] == profile.resolution_px[1]


def test_views_that_do_not_weave_back_are_told(
    command: Command, noise: Path, display: Path, tmp_path: Path
) -> None:
    arguments = ("unweave", noise, "-o", tmp_path / "views", "-d", display, "--json")
    result = command(*arguments, "--rows", 9)
    assert result.json["view_size"][1] == 9
    assert result.json["collisions"] > 0
    (warning,) = result.json["warnings"]
    assert "share a view pixel with another colour" in warning
    assert warning in result.stderr
    fewer = command(*arguments, "--views", 4)
    assert fewer.json["views"] == 4
    assert "4 views of an earlier run, with more views, are removed" in fewer.stderr
    assert len(list((tmp_path / "views").glob("view_*.png"))) == 4


def test_a_wrong_profile_is_measured(
    command: Command, noise: Path, display: Path, tmp_path: Path
) -> None:
    other = tmp_path / "other.json"
    other.write_text(display.read_text().replace('"center": 0.2', '"center": 0.325'))
    arguments = ("unweave", noise, "-d", display, "--check-display", other, "--json")
    result = command(*arguments, "--error-picture", tmp_path / "error.png")
    check = result.json["check"]
    assert (check["mean_views"], check["rms_views"], check["max_views"]) == (1.0, 1.0, 1.0)
    assert check["corner_views"]["top_left"] == 1.0
    assert "off by 1.00 views rms, 1.00 at most, +1.00 on average" in result.stderr
    assert result.json["output"] is None
    picture = read_picture(tmp_path / "error.png")
    assert picture.shape[1] == PANEL[0]
    assert (picture[: PANEL[1], :, 0] > picture[: PANEL[1], :, 2]).all()  # red: from the right
    result = command(*arguments[:-3], "--check-display", "gavane-2024-tilted-4k")
    assert result.code == 4
    assert "compare profiles of one panel" in result.error


def test_wrong_pictures_are_refused(
    command: Command, noise: Path, display: Path, tmp_path: Path
) -> None:
    result = command("unweave", noise, "-o", tmp_path / "views")
    assert result.code == 7
    assert "192 x 108 pixels, made for small; the display" in result.error
    jpeg = tmp_path / "a.jpg"
    Image.open(noise).save(jpeg)
    result = command("unweave", jpeg, "-o", tmp_path / "views", "-d", display, "--json")
    assert "is a JPEG, whose chroma subsampling" in result.json["warnings"][0]


@pytest.fixture
def folder(noise: Path, display: Path, tmp_path: Path) -> Path:
    profile = DisplayProfile.load(display)
    (tmp_path / "views").mkdir()
    write_views(tmp_path / "views", unweave(read_picture(noise), profile, 8), profile)
    return tmp_path / "views"


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("schema", "lfd-views/2", "schema is not lfd-views/1"),
        ("views", "8", "views is '8'"),
        ("views", 9, "view_008.png: cannot be read: No such file"),
        ("views", 0, "0 views of 108 rows; it should be 1 to 4096"),
        ("rows", 109, "8 views of 109 rows"),
        ("columns", 3, "columns is 3; it should be 26"),
        ("profile_hash", "0" * 16, "follow the lenses of 'small', whose figures are not those of"),
    ],
)
def test_spoilt_folders(
    command: Command, folder: Path, display: Path, field: str, value: object, words: str
) -> None:
    data = json.loads((folder / "views.json").read_text())
    (folder / "views.json").write_text(json.dumps(data | {field: value}))
    result = command("weave", folder, "-o", folder.parent / "a.png", "-d", display)
    assert result.code == 7
    assert words in result.error


def test_spoilt_pictures_of_folders(command: Command, folder: Path, display: Path) -> None:
    arguments = ("weave", folder, "-o", folder.parent / "a.png", "-d", display)
    write_png(folder / "view_002.png", np.zeros((5, 7, 3), np.uint8))
    assert "view_002.png: 7 x 5 pixels; views.json says 26 x 108" in command(*arguments).error
    (folder / "views.json").write_text("{")
    assert "views.json: is not JSON" in command(*arguments).error

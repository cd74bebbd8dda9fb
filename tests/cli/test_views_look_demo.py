"""`lfd-render views`, `look` and `demo`, with a renderer that renders nothing."""

import re
from pathlib import Path

import pytest

from lfd_render.panel.picture import read_picture, read_png_text

from .conftest import PANEL, VIEWS, Command, FakeRenderer

pytestmark = pytest.mark.usefixtures("renderer")


@pytest.fixture
def eia(command: Command, scene: Path, display: Path, tmp_path: Path) -> Path:
    path = tmp_path / "eia.png"
    assert command("render", scene, "-o", path, "-d", display, "--views", 4).code == 0
    return path


def test_views_are_numbered_from_the_left(
    command: Command, scene: Path, display: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "views"
    result = command("views", scene, "-o", folder, "-d", display, "--json")
    names = [f"view_{index:03d}.png" for index in range(VIEWS)]
    assert sorted(path.name for path in folder.iterdir()) == names
    assert result.json["output"] == [str(folder / name) for name in names]
    assert result.json["view_size"] == [24, 14]
    shades = [int(read_picture(folder / name)[0, 0, 0]) for name in names]
    assert shades == list(range(VIEWS))
    texts = [read_png_text(folder / name) for name in names]
    assert [text["lfd:view"] for text in texts] == [str(index) for index in range(VIEWS)]
    assert texts[0]["lfd:profile"] == "small"


def test_arrays_are_numbered_from_the_top_left(
    command: Command, renderer: FakeRenderer, scene: Path, display: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "array"
    arguments = ("views", scene, "-o", folder, "-d", display, "--views", 2, "--json")
    result = command(*arguments, "--camera-rows", 3, "--vertical-cone", 30)
    names = [f"view_r{row:02d}_c{view:03d}.png" for row in range(3) for view in range(2)]
    assert result.json["output"] == [str(folder / name) for name in names]
    assert result.json["views"] == 2
    text = read_png_text(folder / names[5])
    assert (text["lfd:row"], text["lfd:view"], text["lfd:views"]) == ("2", "1", "2")
    heights = renderer.calls[-1]["heights_mm"]
    assert result.json["heights_mm"] == heights
    assert float(text["lfd:height-mm"]) == heights[2]
    assert heights[0] > 0 == heights[1] > heights[2]
    plain = command(*arguments)  # which ends the array that was there
    assert sorted(path.name for path in folder.iterdir()) == ["view_000.png", "view_001.png"]
    assert "6 views of an earlier run" in plain.stderr


@pytest.mark.parametrize(
    ("options", "code", "message"),
    [
        (
            ("--vertical-cone", 20),
            2,
            "--vertical-cone: is for rows of cameras; give --camera-rows, too",
        ),
        (("--camera-rows", 2, "--vertical-cone", 180), 2, "vertical cone is 180 degrees"),
        (("--camera-rows", 0), 2, "'--camera-rows': Input should be greater than or equal to 1"),
    ],
)
def test_what_is_no_array(
    command: Command, scene: Path, tmp_path: Path, options: tuple[object, ...], code: int,
    message: str,
) -> None:  # fmt: skip
    result = command("views", scene, "-o", tmp_path / "views", *options)
    assert result.code == code
    assert message in result.stderr
    assert not (tmp_path / "views").exists()


def test_views_end_what_was_told_of_others(
    command: Command, scene: Path, display: Path, tmp_path: Path
) -> None:
    """Upright views must not be taken for the lens-aligned ones that a folder held before."""
    folder = tmp_path / "views"
    folder.mkdir()
    (folder / "views.json").write_text("{}")
    (folder / f"view_{VIEWS:03d}.png").touch()
    (folder / "mine.txt").touch()
    result = command("views", scene, "-o", folder, "-d", display, "--json")
    assert {path.name for path in folder.iterdir() if path.suffix != ".png"} == {"mine.txt"}
    assert "views.json: tells of the views that were here before" in result.stderr
    assert "1 views of an earlier run" in result.stderr
    assert "something odd" in result.json["warnings"]  # of the device, beside the scene's own


def test_sweeps_remove_frames_of_longer_ones(
    command: Command, eia: Path, display: Path, tmp_path: Path
) -> None:
    arguments = ("look", eia, "-d", display, "-o", tmp_path / "sweep", "--sweep")
    assert command(*arguments, "-10:10:4").code == 0
    result = command(*arguments, "-5:5:2")
    assert len(list((tmp_path / "sweep").iterdir())) == 2
    assert "2 frames of an earlier run" in result.stderr


def test_a_failure_leaves_no_folder(
    command: Command, renderer: FakeRenderer, scene: Path, display: Path, tmp_path: Path
) -> None:
    renderer.error = RuntimeError("broken")
    assert command("views", scene, "-o", tmp_path / "views", "-d", display).code == 1
    assert list(tmp_path.iterdir()) == []


def test_views_need_a_folder(command: Command, scene: Path, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    result = command("views", scene, "-o", tmp_path / "file")
    assert result.code == 8
    assert "is a file" in result.error


def test_look_takes_the_number_of_views_from_the_file(
    command: Command, eia: Path, display: Path, tmp_path: Path
) -> None:
    out = tmp_path / "seen.png"
    arguments = ("look", eia, "--display", display, "--angle", -5, "-o", out, "--json")
    default, asked = command(*arguments), command(*arguments, "--views", 16)
    assert default.json["angle_deg"] == -5
    assert default.json["view_size"][1] > asked.json["view_size"][1]
    width, height = command(*arguments, "--view-size", "40x30").json["view_size"]
    assert (width, height) == (40, 30)
    assert read_picture(out).shape == (30, 40, 3)


def test_look_refuses_another_display_s_picture(
    command: Command, eia: Path, tmp_path: Path
) -> None:
    result = command("look", eia, "--angle", 0, "-o", tmp_path / "a.png")
    assert result.code == 7
    assert "192 x 108" in result.error
    assert "small" in result.error


def test_look_warns_of_other_figures(
    command: Command, eia: Path, display: Path, tmp_path: Path
) -> None:
    other = tmp_path / "other.json"
    other.write_text(display.read_text().replace('"center": 0.2', '"center": 0.3'))
    result = command("look", eia, "--angle", 0, "-o", tmp_path / "a.png", "-d", other)
    assert result.code == 0
    assert "figures differ" in result.stderr


def test_look_takes_eyes_pairs_and_sweeps(
    command: Command, eia: Path, display: Path, tmp_path: Path
) -> None:
    look = ("look", eia, "--display", display, "--view-size", "40x30", "--json")
    out = tmp_path / "seen.png"
    one = command(*look, "--eye", "12.5,-3,420", "-o", out)
    assert one.json["eyes_mm"] == [[[12.5, -3, 420]]]
    pair = command(*look, "--eye", "0,0,420", "--stereo", "--crosstalk", 1, "-o", out)
    assert pair.json["eyes_mm"] == [[[-32, 0, 420], [32, 0, 420]]]
    assert read_picture(out).shape == (30, 88, 3)
    strip = command(*look, "--sweep", "-10:10:3", "--optics", "slab", "-o", out)
    assert len(strip.json["eyes_mm"]) == 3
    assert read_picture(out).shape == (30, 136, 3)
    frames = command(*look, "--sweep", "-10:10:3", "--stereo", "-o", tmp_path / "frames")
    names = [f"frame_{index:03d}.png" for index in range(3)]
    assert frames.json["output"] == [str(tmp_path / "frames" / name) for name in names]
    assert read_picture(tmp_path / "frames" / names[2]).shape == (30, 88, 3)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "one of angle, eye and sweep; got none"),
        (("--angle", 1, "--eye", "0,0,1"), "got angle and eye"),
        (("--angle", 90), "between -90 and 90"),
        (("--eye", "0,0"), "--eye: '0,0'; give X,Y,Z"),
        (("--eye", "0,0,-5"), "behind the panel"),
        (("--sweep", "0:1"), "--sweep: '0:1'; give FROM:TO:N"),
        (("--sweep", "0:1:1"), "2 to 1000 steps"),
    ],
)
def test_look_names_bad_eyes(
    command: Command, eia: Path, display: Path, tmp_path: Path, arguments: tuple, message: str
) -> None:
    result = command("look", eia, "-d", display, "-o", tmp_path / "a.png", *arguments)
    assert result.code == 2
    assert message in result.error


def test_a_cone_of_nothing_is_named(
    command: Command, eia: Path, display: Path, tmp_path: Path
) -> None:
    flat = tmp_path / "flat.json"
    text = display.read_text()
    flat.write_text(re.sub(r'"cone_deg": [0-9.]+', '"cone_deg": 0', text))
    result = command("look", eia, "--angle", 0, "-o", tmp_path / "a.png", "-d", flat)
    assert result.code == 4
    assert "viewing.cone_deg" in result.error
    assert "greater than 0" in result.error


def test_demo_shows_three_eyes(command: Command, display: Path, tmp_path: Path) -> None:
    folder = tmp_path / "demo"
    assert command("demo", folder, "--display", display).code == 0
    shapes = {path.stem: read_picture(path).shape for path in folder.iterdir()}
    assert shapes["eia"] == (PANEL[1], PANEL[0], 3)
    assert shapes["left"] == shapes["centre"] == shapes["right"]
    height, width, _ = shapes["left"]
    assert shapes["preview"] == (height, 3 * width + 16, 3)

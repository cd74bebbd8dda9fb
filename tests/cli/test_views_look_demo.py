"""`lfd-render views`, `look` and `demo`, with a renderer that renders nothing."""

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


def test_demo_shows_three_eyes(command: Command, display: Path, tmp_path: Path) -> None:
    folder = tmp_path / "demo"
    assert command("demo", folder, "--display", display).code == 0
    shapes = {path.stem: read_picture(path).shape for path in folder.iterdir()}
    assert shapes["eia"] == (PANEL[1], PANEL[0], 3)
    assert shapes["left"] == shapes["centre"] == shapes["right"]
    height, width, _ = shapes["left"]
    assert shapes["preview"] == (height, 3 * width + 16, 3)

"""Closed and broken streams, and folders of results: one line or silence, nothing half done."""

import errno
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import lfd_render.panel.picture
from lfd_render.errors import OutputError

from .conftest import Command, FakeRenderer

PROGRAM = f"{sys.executable} -m lfd_render.cli.main"


def shell(command: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["bash", "-c", f"{command}; exit ${{PIPESTATUS[0]}}"],
        capture_output=True,
        text=True,
        check=False,
        stdin=subprocess.DEVNULL,
    )


@pytest.mark.parametrize("arguments", ["doctor --json", "doctor"])
def test_a_closed_stdout_is_one_error(arguments: str) -> None:
    done = shell(f"{PROGRAM} {arguments} >&-")
    assert done.returncode == 8
    assert done.stderr == "lfd-render: error: stdout: Bad file descriptor; keep its reader open\n"


def test_a_command_that_prints_nothing_needs_no_stdout(display: Path, tmp_path: Path) -> None:
    command = "render builtin:chart?triangles=1000 --views 2 --view-size 8x8"
    done = shell(f"{PROGRAM} {command} -d {display} -o {tmp_path}/a.png >&-")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "a.png").exists()


@pytest.mark.parametrize("closing", ["2>&-", ">&- 2>&-"])
def test_a_closed_stderr_keeps_the_exit_code(closing: str) -> None:
    done = shell(f"{PROGRAM} nonsense {closing}")
    assert (done.returncode, done.stdout, done.stderr) == (2, "", "")


def test_a_reader_that_goes_away_is_one_error() -> None:
    done = shell(f"{PROGRAM} doctor | head -0")
    assert done.returncode == 8
    assert "Traceback" not in done.stderr


def test_a_reader_of_stderr_that_goes_away_is_no_error(tmp_path: Path) -> None:
    done = shell(f"{PROGRAM} nonsense 2> >(exec true); echo $? > {tmp_path}/code")
    assert (tmp_path / "code").read_text() == "2\n"
    assert "Traceback" not in done.stderr


# ---- folders ----------------------------------------------------------------------------------


def test_a_pipe_is_no_display(command: Command, scene: Path, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.json")
    result = command("render", scene, "-o", tmp_path / "a.png", "-d", tmp_path / "pipe.json")
    assert result.code == 4
    assert result.error.endswith("is not a regular file; give the path of a JSON file")


def test_views_go_to_a_folder(
    command: Command, renderer: FakeRenderer, scene: Path, tmp_path: Path
) -> None:
    result = command("views", scene, "-o", "-")
    assert result.code == 2
    assert result.error == "-o -: the result is several files; give a folder"
    assert not renderer.calls


def test_views_of_an_earlier_run_are_replaced(
    command: Command, renderer: FakeRenderer, scene: Path, display: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "views"
    assert command("views", scene, "-o", folder, "-d", display, "--views", 5).code == 0
    (folder / "view_of_the_sea.png").touch()
    result = command("views", scene, "-o", folder, "-d", display, "--views", 3)
    assert result.code == 0
    names = {"view_000.png", "view_001.png", "view_002.png", "view_of_the_sea.png"}
    assert {file.name for file in folder.iterdir()} == names
    assert "2 views of an earlier run, with more views, are removed" in result.stderr


@pytest.mark.parametrize("there", [False, True])
def test_a_full_disk_leaves_no_views(
    command: Command,
    renderer: FakeRenderer,
    scene: Path,
    display: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    there: bool,
) -> None:
    folder = tmp_path / "views"
    if there:
        folder.mkdir()
        (folder / "view_000.png").write_bytes(b"earlier")
    write_png = lfd_render.panel.picture.write_png

    def fills_up(path: Path, pixels: np.ndarray, text: dict[str, str]) -> None:
        if "002" in path.name:
            raise OutputError(f"{path}: {os.strerror(errno.ENOSPC)}")
        write_png(path, pixels, text)

    monkeypatch.setattr(lfd_render.panel.picture, "write_png", fills_up)
    result = command("views", scene, "-o", folder, "-d", display, "--views", 4)
    assert result.code == 8
    assert folder.exists() == there
    if there:
        assert [file.name for file in folder.iterdir()] == ["view_000.png"]
        assert (folder / "view_000.png").read_bytes() == b"earlier"


# ---- warnings and limits ----------------------------------------------------------------------


@pytest.mark.parametrize("name", ["render", "views"])
def test_warnings_of_the_display_are_in_the_json(
    command: Command, renderer: FakeRenderer, scene: Path, tmp_path: Path, name: str
) -> None:
    output = tmp_path / ("a.png" if name == "render" else "views")
    result = command(name, scene, "-o", output, "--views", 2, "--json")
    assert result.code == 0
    assert "its figures are a model's or assumed" in json.loads(result.stdout)["warnings"][0]


def test_an_option_of_a_scene_given_twice_is_refused(command: Command, tmp_path: Path) -> None:
    scene = "builtin:chart?triangles=1000&triangles=2000"
    result = command("render", scene, "-o", tmp_path / "a.png")
    assert result.code == 3
    assert "option: 'triangles' is given twice; give it once" in result.error


def test_look_bounds_its_views(
    command: Command, renderer: FakeRenderer, scene: Path, display: Path, tmp_path: Path
) -> None:
    assert command("render", scene, "-o", tmp_path / "a.png", "-d", display).code == 0
    result = command(
        "look", tmp_path / "a.png", "--angle", 0, "-o", tmp_path / "b.png", "-d", display,
        "--views", 10**9,
    )  # fmt: skip
    assert result.code == 2
    assert "should be from 1 to 4096" in result.error

"""The commands with the real renderer, each in a process of its own as a person runs it."""

import json
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lfd_render.panel.picture import read_picture

from .conftest import PANEL, VIEWS

pytestmark = pytest.mark.needs("gl")


def run(*arguments: object, folder: Path) -> dict[str, Any]:
    """Run the command line in another folder; its JSON object."""
    command = [sys.executable, "-m", "lfd_render.cli.main", *map(str, arguments), "--json"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def test_scene_to_panel_image_to_eye(scene: Path, display: Path, tmp_path: Path) -> None:
    rendered = run("render", scene, "-o", "eia.png", "-d", display, folder=tmp_path)
    assert rendered["views"] == VIEWS
    assert rendered["triangles"] == 1
    assert rendered["points"] > 0
    assert rendered["timings_ms"]["total"] > rendered["timings_ms"]["frame"] > 0
    assert read_picture(tmp_path / "eia.png").shape == (PANEL[1], PANEL[0], 3)

    for angle in (-10, 0, 10):
        seen_file = f"seen{angle}.png"
        seen = run(
            "look", "eia.png", "--angle", angle, "-o", seen_file, "-d", display, folder=tmp_path
        )
        luma = read_picture(tmp_path / seen_file).mean(axis=2)
        assert seen["view_size"] == [luma.shape[1], luma.shape[0]]
        # The triangle stands upright: its lower half covers more than its upper half.
        lit = luma > 20
        middle = luma.shape[0] // 2
        assert lit[middle:].sum() > 2 * lit[:middle].sum() > 0


def test_views_differ_by_parallax(scene: Path, display: Path, tmp_path: Path) -> None:
    found = run("views", scene, "-o", "views", "-d", display, "--yaw", "30", folder=tmp_path)
    first, last = (
        read_picture(tmp_path / found["output"][index]).astype(np.int64) for index in (0, -1)
    )
    assert first.shape == last.shape == (*found["view_size"][::-1], 3)
    assert np.abs(first - last).max() > 50


def test_scene_to_quilt_to_panel_image_to_views_and_back(
    scene: Path, display: Path, tmp_path: Path
) -> None:
    made = run("quilt", scene, "-o", "q", "-d", display, "--tiles", "4x2", folder=tmp_path)
    assert made["output"] == "q_qs4x2a1.77778.png"
    run("weave", made["output"], "-o", "eia.png", "-d", display, folder=tmp_path)
    found = run("unweave", "eia.png", "-o", "views", "-d", display, folder=tmp_path)
    assert (len(found["output"]), found["collisions"]) == (VIEWS, 0)
    run("weave", "views", "-o", "again.png", "-d", display, folder=tmp_path)
    woven = read_picture(tmp_path / "eia.png")
    np.testing.assert_array_equal(read_picture(tmp_path / "again.png"), woven)
    assert woven.std() > 20  # and there is a picture


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_an_interrupted_render_leaves_nothing(
    number: signal.Signals, code: int, scene: Path, tmp_path: Path
) -> None:
    # Not by -m, which now and then ends by the signal itself after the handler has run.
    script = "import sys; from lfd_render.cli.main import main; sys.exit(main())"
    command = [sys.executable, "-c", script, "render", str(scene)]
    command += ["-o", str(tmp_path / "eia.png"), "--views", "2", "--repeat", "1000000"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        assert "warning: display" in process.stderr.readline()
        process.send_signal(number)
        try:
            assert process.wait(timeout=60) == code
            assert process.stderr.read() in ("", "lfd-render: error: interrupted\n")
        finally:
            process.kill()  # or one that has not ended would be waited for
    assert list(tmp_path.iterdir()) == []

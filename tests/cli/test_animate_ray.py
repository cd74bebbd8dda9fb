"""`lfd-render animate` on Ray: an actor dies, and every frame is what the local engine makes."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from .conftest import Command

SCENE = "builtin:spheres?triangles=1000"
MOVING = ("--motion", "orbit", "--fps", 10, "--period", 4)


def begun(*arguments: object) -> "subprocess.Popen[str]":
    command = [sys.executable, "-m", "lfd_render.cli.main", "animate", SCENE]
    command += map(str, (*MOVING, *arguments))
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def frames(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(folder.glob("frame_*"))}


def painters(driver: int) -> list[int]:
    """The actors' processes below the driver's."""
    parents, actors = {}, []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            parents[int(folder.name)] = int(
                (folder / "stat").read_text().rpartition(")")[2].split()[1]
            )
            if (folder / "cmdline").read_bytes().startswith(b"ray::Painter"):
                actors.append(int(folder.name))
        except (OSError, IndexError):
            continue  # it has ended

    def below(pid: int) -> bool:
        return pid == driver or (pid > 1 and below(parents.get(pid, 0)))

    return [pid for pid in actors if below(pid)]


@pytest.mark.needs("gl")
@pytest.mark.needs("ray")
@pytest.mark.shows("Ray: all frames with an actor killed mid-run, bytes equal to local")
def test_an_actor_dies(
    display: Path,
    tmp_path: Path,
    scaled: Callable[[int, int], int],
    measured: Callable[[str, str], None],
) -> None:
    count = scaled(60, 40)
    arguments = ("-d", display, "--frames", f"0:{count - 1}", "--json")
    folder, url = tmp_path / "ray", tmp_path / "local"
    with begun(*arguments, "-o", folder, "--engine", "ray", "--processes", 2) as driver:
        while driver.poll() is None and not (folder.exists() and len(frames(folder)) > 2):
            time.sleep(0.005)
        actors = painters(driver.pid)
        there = len(frames(folder))
        os.kill(actors[0], signal.SIGKILL)
        out, said = driver.communicate(timeout=180)
    assert driver.returncode == 0, said
    assert len(actors) == 2
    assert "A worker died" in said  # Ray's own words, kept off stdout
    assert there < count
    assert json.loads(out)["made"] == count
    with begun(*arguments, "-o", f"file://{url}") as local:
        assert local.wait(180) == 0
    assert len(frames(folder)) == count
    assert frames(folder) == frames(url)
    measured("frames on Ray", f"{count} of {count}, an actor killed after {there}")


@pytest.mark.needs("ray")
def test_a_cluster_that_is_not_there(command: Command, display: Path, tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    given = ("-o", tmp_path / "out", "-d", display, "--frames", "0:3")
    engine = ("--engine", f"ray://127.0.0.1:{port}")
    result = command("animate", SCENE, *MOVING, *given, *engine)
    assert result.code == 2
    assert "nobody answers: Connection refused; start a cluster with 'ray start" in result.error
    assert not (tmp_path / "out").exists()


def test_ray_is_an_extra(
    command: Command, display: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    given = ("-o", tmp_path / "out", "-d", display, "--frames", "0:3", "--engine", "ray")
    result = command("animate", SCENE, *MOVING, *given)
    assert result.code == 2
    assert "ray is not installed; pip install 'lfd-render[ray]'" in result.error


@pytest.mark.needs("ray")
def test_ray_accepts_the_cluster_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import yaml  # noqa: PLC0415 (comes with Ray)
    from ray.autoscaler._private.util import prepare_config, validate_config  # noqa: PLC0415

    monkeypatch.setenv("RAY_TMPDIR", str(tmp_path))  # where it keeps what it knows of clusters
    file = Path(__file__).resolve().parents[2] / "deploy" / "ray-cluster.yaml"
    cluster = yaml.safe_load(file.read_text(encoding="utf-8"))
    starts = cluster["head_start_ray_commands"] + cluster["worker_start_ray_commands"]
    assert all("RAY_AUTH_MODE=token" in line for line in starts if " start " in line)
    validate_config(prepare_config(cluster))
    cluster["workers"] = 2
    with pytest.raises(Exception, match="workers"):
        validate_config(prepare_config(cluster))

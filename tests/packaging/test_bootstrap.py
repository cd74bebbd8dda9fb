"""Preparing a machine: what is asked of apt, what a person is told, which Python is taken."""

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

from lfd_render.gpu import system

REPOSITORY = Path(__file__).resolve().parents[2]


@pytest.fixture
def bare(monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine without GL and lavapipe, on which this process may not install."""
    parts = {
        "gl": (lambda: "libGL.so.1: no such file", system.GL_PACKAGES),
        "venv": (lambda: None, system.VENV_PACKAGES),
        "zink": (lambda: "no lavapipe", system.ZINK_PACKAGES),
        "browser": (lambda: "no chromium", system.BROWSER_PACKAGES),
    }
    monkeypatch.setattr(system, "PARTS", parts)
    monkeypatch.setattr(system, "_privilege", lambda: None)
    monkeypatch.setattr(system.shutil, "which", lambda name: f"/usr/bin/{name}")
    monkeypatch.setattr(system.os, "geteuid", lambda: 1000)


@pytest.mark.usefixtures("bare")
def test_it_prints_the_exact_command_and_stops(capsys: pytest.CaptureFixture[str]) -> None:
    assert system.main(["gl", "venv", "zink?"]) == 1
    told = capsys.readouterr().err
    assert "gl is missing: libGL.so.1: no such file" in told
    assert (
        "  sudo apt-get update && sudo apt-get install -y --no-install-recommends "
        "libegl1 libgl1 libgl1-mesa-dri mesa-vulkan-drivers\n"
    ) in told


@pytest.mark.usefixtures("bare")
def test_a_wanted_part_does_not_stop(capsys: pytest.CaptureFixture[str]) -> None:
    assert system.main(["venv", "zink?"]) == 0
    assert "zink is missing" in capsys.readouterr().err


@pytest.mark.usefixtures("bare")
@pytest.mark.parametrize(
    ("failures", "expected"),
    [
        ([], ["install", "check"]),
        (["install"], ["install", "update", "install", "check"]),
        (["install", "update"], ["install", "update"]),
    ],
)
def test_it_installs_where_permitted(
    monkeypatch: pytest.MonkeyPatch, failures: list[str], expected: list[str]
) -> None:
    done: list[str] = []

    def run(command: Sequence[str], errors: bool = False) -> bool:
        words = {"install": "install", "update": "update", "--check": "check"}
        done.append(next(words[word] for word in command if word in words))
        if done[-1] == "install":
            assert list(command[:4]) == ["sudo", "-n", "env", "DEBIAN_FRONTEND=noninteractive"]
            assert list(command[-3:]) == list(system.GL_PACKAGES)
        if done[-1] in failures[:1]:
            failures.pop(0)
            return False
        return True

    monkeypatch.setattr(system, "_privilege", lambda: ["sudo", "-n"])
    monkeypatch.setattr(system, "_run", run)
    succeeded = "check" in expected
    assert (system.main(["gl", "venv"]) == 0) == succeeded
    assert done == expected


@pytest.mark.usefixtures("bare")
def test_a_wanted_part_that_cannot_be_had_keeps_none_away(monkeypatch: pytest.MonkeyPatch) -> None:
    installed: list[str] = []

    def run(command: Sequence[str], errors: bool = False) -> bool:
        if "install" in command and system.BROWSER_PACKAGES[0] in command:
            return False
        installed.extend(package for package in system.GL_PACKAGES if package in command)
        return True

    monkeypatch.setattr(system, "_privilege", lambda: [])
    monkeypatch.setattr(system, "_run", run)
    assert system.main(["gl", "zink?", "browser?"]) == 0
    assert installed == list(system.GL_PACKAGES)


def bootstrap(*arguments: str, python: str) -> subprocess.CompletedProcess[str]:
    """Run bootstrap.sh with an interpreter of one's choice."""
    return subprocess.run(
        [REPOSITORY / "bootstrap.sh", *arguments],
        env=os.environ | {"PYTHON": python},
        capture_output=True,
        text=True,
        check=False,
    )


def test_python_must_be_new_enough(tmp_path: Path) -> None:
    old = tmp_path / "old python"
    old.write_text("#!/bin/sh\nexit 1\n")
    old.chmod(0o755)
    done = bootstrap("system", "venv", python=str(old))
    assert done.returncode == 1
    assert f"None of these is a Python 3.11 or newer: {old}." in done.stderr


def test_the_named_python_is_taken() -> None:
    done = bootstrap("system", "venv", python=sys.executable)
    assert (done.returncode, done.stderr) == (0, "")


def test_it_explains_itself() -> None:
    done = bootstrap(python=sys.executable)
    assert done.returncode == 2
    assert "bootstrap.sh venv FOLDER EXTRAS" in done.stderr

"""`lfd-render doctor`: with a device, without libraries, and without a driver."""

import ctypes
from typing import Any

import pytest

from lfd_render.cli import doctor as doctor_module
from lfd_render.gpu import system

from .conftest import Command


@pytest.mark.needs("gl")
def test_it_describes_the_device(command: Command) -> None:
    found = command("doctor", "--json").json
    gl = found["gl"]
    assert gl["renderer"]
    assert gl["limits"]["storage_block_bytes"] >= 1 << 27
    assert len(gl["limits"]["work_groups"]) == 3
    assert set(gl["capabilities"]) == set(doctor_module.CAPABILITIES)
    assert found["egl_devices"][gl["egl_index"]]["usable"]
    assert found["packages"]["moderngl"]


@pytest.mark.needs("gl", "zink")
def test_it_finds_64_bit_atomics_in_zink(command: Command) -> None:
    zink = command("doctor", "--json").json["zink"]
    assert zink["renderer"].startswith("zink")
    assert zink["int64_atomics"]


@pytest.mark.needs("gl")
def test_it_says_software_plainly(command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(system, "zink_environment", lambda: None)
    result = command("doctor", "--device", "software")
    assert result.code == 0
    assert "SOFTWARE" in result.stdout


def test_without_libraries_it_explains(command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_library(name: str, *_: Any) -> None:
        raise OSError(f"{name}: cannot open shared object file")

    monkeypatch.setattr(ctypes, "CDLL", no_library)
    monkeypatch.setattr(system.shutil, "which", lambda name: f"/usr/bin/{name}")
    result = command("doctor")
    assert result.code == 5
    assert "libGL.so.1: cannot open" in result.stdout
    assert "apt-get install -y --no-install-recommends libegl1 libgl1" in result.stdout
    assert command("doctor", "--json").json["gl"] is None


def test_without_a_driver_it_explains(command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    device = system.EglDevice(0, "", "", "", software=True, usable=False)
    monkeypatch.setattr(system, "egl_devices", lambda: [device])
    result = command("doctor")
    assert result.code == 5
    assert "no working driver" in result.stdout

"""What all tests share: required parts, full or reduced counts, the one GL device, seeds.

``LFD_REQUIRE=gl,zink,…`` turns a missing part from a skip into a failure; ``LFD_FULL=1`` runs the
full counts of the acceptance lines (``make verify``).
"""

import importlib.util
import os
import shutil
from collections import Counter
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import hypothesis
import numpy as np
import pytest

from lfd_render.gpu import system
from lfd_render.gpu.device import Device

REPOSITORY = Path(__file__).resolve().parent.parent
ASSETS = REPOSITORY.parent / "shared" / "assets"
FULL = os.environ.get("LFD_FULL") == "1"
REQUIRED = set(filter(None, os.environ.get("LFD_REQUIRE", "").split(",")))

hypothesis.settings.register_profile(
    "test", derandomize=True, deadline=None, database=None, max_examples=30
)
hypothesis.settings.register_profile(
    "verify", derandomize=True, deadline=None, database=None, max_examples=1000
)
hypothesis.settings.load_profile("verify" if FULL else "test")


def _zink_problem() -> str | None:
    return None if system.lavapipe_icd() else "lavapipe (mesa-vulkan-drivers) is not installed"


def _ray_problem() -> str | None:
    return None if importlib.util.find_spec("ray") else "ray is not installed (extra [ray])"


def _video_problem() -> str | None:
    return None if importlib.util.find_spec("av") else "PyAV is not installed (extra [video])"


def _lacks(command: str) -> str | None:
    return None if shutil.which(command) else f"{command} is not installed"


PROBLEMS: dict[str, Callable[[], str | None]] = {
    "gl": system.gl_problem,
    "zink": _zink_problem,
    "browser": system.browser_problem,
    "ray": _ray_problem,
    "video": _video_problem,
    "curl": partial(_lacks, "curl"),
    "kubectl": partial(_lacks, "kubectl"),
}


def need(part: str) -> None:
    """Skip the running test when a part is missing; fail it when LFD_REQUIRE names the part."""
    problem = PROBLEMS[part]()
    if problem and part in REQUIRED:
        pytest.fail(f"LFD_REQUIRE names {part}, but {problem}", pytrace=False)
    if problem:
        pytest.skip(f"[{part}] {problem}")


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "needs(part): skips without the part, see LFD_REQUIRE")
    config.addinivalue_line("markers", "shows(line): the acceptance line that the test shows")
    if unknown := REQUIRED - set(PROBLEMS):
        raise pytest.UsageError(
            f"LFD_REQUIRE: unknown part {', '.join(sorted(unknown))}; use {', '.join(PROBLEMS)}"
        )


def pytest_runtest_setup(item: pytest.Item) -> None:
    for marker in item.iter_markers("needs"):
        for part in marker.args:
            need(part)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    reports = terminalreporter.stats.get("skipped", [])
    reasons = Counter(str(report.longrepr[2]).removeprefix("Skipped: ") for report in reports)
    if reasons:
        terminalreporter.section("parts that were missing")
        for reason, count in sorted(reasons.items()):
            terminalreporter.line(f"{count} tests skipped: {reason}")


@pytest.fixture(scope="session")
def device() -> Iterator[Device]:
    """The one GL context of the run."""
    need("gl")
    device = Device.open("auto")
    yield device
    device.close()


@pytest.fixture(autouse=True)
def _gl_error_state(request: pytest.FixtureRequest) -> Iterator[None]:
    """Around each test with the device: no GL error pending before, none left after."""
    if "device" not in request.fixturenames:
        yield
        return
    device: Device = request.getfixturevalue("device")
    device.activate()
    device.check()
    yield
    device.activate()
    device.check()


@pytest.fixture(scope="session")
def zink() -> dict[str, str]:
    """The environment of a process whose OpenGL runs through zink, with 64-bit atomics."""
    need("zink")
    return os.environ | (system.zink_environment() or {})


@pytest.fixture(scope="session")
def assets_if_any() -> Path:
    """Where the real models would be, for tests that have a substitute for each."""
    return ASSETS


@pytest.fixture(scope="session")
def assets() -> Path:
    """The folder of real models beside the checkout."""
    if not ASSETS.is_dir():
        pytest.skip("[assets] no folder ../shared/assets beside the checkout")
    return ASSETS


@pytest.fixture(scope="session")
def full_counts() -> bool:
    """Whether the full counts of the acceptance lines run."""
    return FULL


@pytest.fixture(scope="session")
def scaled() -> Callable[[int, int], int]:
    """``scaled(full, reduced)`` gives the count to use in this run."""
    return lambda full, reduced: full if FULL else reduced


@pytest.fixture
def rng() -> np.random.Generator:
    """Random numbers that are the same in every run."""
    return np.random.default_rng(20240917)


@pytest.fixture
def measured(record_property: Callable[[str, object], None]) -> Callable[[str, str], None]:
    """``measured("frame time", "812 ms, at most 1500")`` puts a figure on the verification page."""
    return record_property

"""Pytest plugin of ``make verify``: writes what was run, where and with what result.

The page is ``docs/verify/<date>.md``. A test names the acceptance line that it shows by
``@pytest.mark.shows("…")`` and reports figures through the ``measured`` fixture.
"""

import datetime
import json
import os
import platform
import shutil
import subprocess
import sys
import time
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

FOLDER = Path(__file__).resolve().parent.parent / "docs" / "verify"


@dataclass
class Outcome:
    """What became of one test, over its set-up, call and tear-down."""

    node: str
    line: str = ""
    result: str = "passed"
    reason: str = ""
    seconds: float = 0.0
    figures: dict[str, Any] = field(default_factory=dict)

    def add(self, report: pytest.TestReport) -> None:
        self.seconds += report.duration
        self.figures.update(report.user_properties)
        if report.failed:
            self.result = "FAILED"
            self.reason = report.longreprtext.strip().splitlines()[-1]
        elif report.skipped and self.result == "passed":
            self.result = "skipped"
            self.reason = str(report.longrepr[2]) if isinstance(report.longrepr, tuple) else ""


class Recorder:
    """Collects outcomes during the run and writes the page at its end."""

    def __init__(self) -> None:
        self.outcomes: dict[str, Outcome] = {}
        self.started = time.monotonic()

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        for item in items:
            marker = item.get_closest_marker("shows")
            self.outcomes[item.nodeid] = Outcome(item.nodeid, marker.args[0] if marker else "")

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        self.outcomes[report.nodeid].add(report)

    def pytest_sessionfinish(self) -> None:
        FOLDER.mkdir(parents=True, exist_ok=True)
        today = datetime.date.today().isoformat()
        seconds = time.monotonic() - self.started
        page = write_page(today, describe_machine(), list(self.outcomes.values()), seconds)
        (FOLDER / f"{today}.md").write_text(page, encoding="utf-8")

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        terminalreporter.line(f"Result page: docs/verify/{datetime.date.today().isoformat()}.md")


def pytest_configure(config: pytest.Config) -> None:
    config.pluginmanager.register(Recorder())


def describe_machine() -> dict[str, str]:
    """What the figures depend on: commit, processor, system, GL renderer, versions."""
    command = [sys.executable, "-m", "lfd_render.cli.main", "doctor", "--json"]
    doctor = subprocess.run(command, capture_output=True, text=True, check=False)
    found = json.loads(doctor.stdout) if doctor.stdout else {}
    gl = found.get("gl") or {"renderer": "none", "version": "none"}
    zink = found.get("zink") or {"renderer": "none"}
    return {
        "commit": _git("rev-parse", "--short", "HEAD")
        + (" with uncommitted changes" if _git("status", "--porcelain", "-uno") else ""),
        "processor": f"{os.cpu_count()} × {_processor()}",
        "system": f"{_system()}, Python {platform.python_version()}",
        "OpenGL": f"{gl['renderer']}, {gl['version']}",
        "zink": zink["renderer"],
        "packages": ", ".join(f"{k} {v}" for k, v in found.get("packages", {}).items()),
    }


def write_page(date: str, machine: dict[str, str], outcomes: list[Outcome], seconds: float) -> str:
    """The whole page as Markdown."""
    counts = {r: sum(o.result == r for o in outcomes) for r in ("passed", "FAILED", "skipped")}
    summary = ", ".join(f"{count} {result}" for result, count in counts.items() if count)
    facts = machine | {"result": f"{summary} in {seconds / 60:.1f} minutes"}
    parts = [
        f"# Verification of {date}\n\nWritten by `make verify`, full counts.\n",
        _table(("", ""), list(facts.items())),
    ]
    if lines := [o for o in outcomes if o.line]:
        rows = [(o.line, o.result, _figures(o), f"`{o.node}`") for o in lines]
        parts.append(
            "## Acceptance lines\n\n" + _table(("Line", "Result", "Figures", "Test"), rows)
        )
    if others := [o for o in outcomes if o.figures and not o.line]:
        rows = [(f"`{o.node}`", o.result, _figures(o)) for o in others]
        parts.append("## Other figures\n\n" + _table(("Test", "Result", "Figures"), rows))
    if troubled := [o for o in outcomes if o.result != "passed"]:
        rows = [(f"`{o.node}`", o.result, o.reason) for o in troubled]
        parts.append("## Failed and skipped\n\n" + _table(("Test", "Result", "Why"), rows))
    parts.append("## All tests\n\n" + _by_file(outcomes))
    return "\n".join(parts)


def _by_file(outcomes: list[Outcome]) -> str:
    files: dict[str, list[Outcome]] = defaultdict(list)
    for outcome in outcomes:
        files[outcome.node.split("::")[0]].append(outcome)
    rows = [
        (
            f"`{name}`",
            *(sum(o.result == r for o in group) for r in ("passed", "FAILED", "skipped")),
            f"{sum(o.seconds for o in group):.1f}",
        )
        for name, group in sorted(files.items())
    ]
    return _table(("File", "Passed", "Failed", "Skipped", "Seconds"), rows)


def _figures(outcome: Outcome) -> str:
    return "; ".join(f"{name}: {value}" for name, value in outcome.figures.items())


def _table(head: tuple[str, ...], rows: list[tuple[Any, ...]]) -> str:
    cells = [[str(cell).replace("|", "\\|").replace("\n", " ") for cell in row] for row in rows]
    lines = [head, ["---"] * len(head), *cells]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _git(*arguments: str) -> str:
    if not shutil.which("git"):
        return ""
    done = subprocess.run(
        ["git", *arguments], cwd=FOLDER.parent, capture_output=True, text=True, check=False
    )
    return done.stdout.strip()


def _processor() -> str:
    lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    names = [line.split(":")[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def _system() -> str:
    try:
        return platform.freedesktop_os_release()["PRETTY_NAME"]
    except OSError:
        return platform.platform()

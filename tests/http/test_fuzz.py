"""Whatever is sent within and without the description gets a status that it names, and no 5xx.

Most cases go to a server whose pictures take no time; a share goes to one that renders.
"""

import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from .conftest import PROFILE, Server, Start
from .faults.sitecustomize import BREAK

pytestmark = pytest.mark.needs("gl")
HERE = Path(__file__).parent
HOOKS = {"PYTHONPATH": str(HERE / "cheap"), "SCHEMATHESIS_HOOKS": "fuzzed"}
CHECKS = [
    "not_a_server_error", "status_code_conformance", "content_type_conformance",
    "response_headers_conformance", "response_schema_conformance", "missing_required_header",
    "unsupported_method", "allow_header_conformance", "use_after_free",
]  # fmt: skip


def fuzz(server: Server, folder: Path, *arguments: str, **settings: str) -> tuple[int, str]:
    """How many cases schemathesis sent, and what it says if it found anything."""
    done = subprocess.run(
        [
            sys.executable, "-m", "schemathesis.cli", "run", f"{server.url}/openapi.json",
            "--no-color", "--checks", ",".join(CHECKS), "--seed", "1", "--request-timeout", "60",
            "--generation-database", "none", "--suppress-health-check", "all", *arguments,
        ],
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | settings | HOOKS,
        cwd=folder,  # where it leaves what it remembers
    )  # fmt: skip
    cases = re.search(r"(\d+) generated", done.stdout)
    assert cases, done.stdout + done.stderr
    return int(cases[1]), done.stdout if done.returncode else ""


@pytest.mark.shows("schemathesis, all phases: no 5xx, no undocumented status")
def test_no_request_is_answered_by_an_undescribed_status(
    start: Start, tmp_path: Path, scaled: Callable[[int, int], int],
    measured: Callable[[str, str], None],
) -> None:  # fmt: skip
    phases = "examples,coverage,fuzzing,stateful"
    each = scaled(2500, 4)
    with start("--processes", "1", python_path=HERE / "cheap") as server:
        cases, found = fuzz(server, tmp_path, "--phases", phases, "--max-examples", str(each))
    assert not found, found
    assert cases >= scaled(100_000, 4000)
    assert not [line for line in server.log if '"level": "error"' in line]
    measured("requests of all phases", f"{cases}, no 5xx, no undocumented status")


def test_pictures_that_are_rendered(
    start: Start, tmp_path: Path, scaled: Callable[[int, int], int]
) -> None:
    with start("--processes", "1") as server, server.client() as client:
        client.put("/v1/displays/small", json=PROFILE)
        drawn = ["--include-path-regex", "/(eia|look|view|views|quilt|stream|render)$"]
        cases, found = fuzz(
            server, tmp_path, "--phases", "examples,fuzzing", "--max-examples", str(scaled(500, 3)),
            "--exclude-method", "HEAD", *drawn, LFD_FUZZ_SMALL="1",
        )  # fmt: skip
    assert not found, found
    assert cases >= scaled(3000, 18)


def test_a_planted_fault_is_found(start: Start, tmp_path: Path) -> None:
    with start("--processes", "1", python_path=HERE / "faults") as server:
        broken = ["--phases", "coverage", "--include-path", "/v1/render", "--mode", "positive"]
        _, found = fuzz(server, tmp_path, *broken, LFD_FUZZ_SEED=str(BREAK))
    assert "Server error" in found

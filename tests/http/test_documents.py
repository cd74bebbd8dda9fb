"""The README's lines about the server work as they stand there, and docs/service.md says it all."""

import json
import os
import re
import shutil
import struct
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from lfd_render.service.settings import Settings

from .conftest import PROFILE, Server, Start

REPOSITORY = Path(__file__).resolve().parents[2]
SERVED = "http://127.0.0.1:8000"


@pytest.fixture(scope="module")
def server(start: Start) -> Iterator[Server]:
    with start() as server:
        yield server


@pytest.mark.needs("gl")
@pytest.mark.skipif(not shutil.which("curl"), reason="[curl] curl is not installed")
@pytest.mark.shows("the README's curl lines give the command line's EIA, bit for bit")
def test_the_readmes_lines_give_the_command_lines_picture(
    server: Server, triangle: bytes, tmp_path: Path
) -> None:
    readme = (REPOSITORY / "README.md").read_text(encoding="utf-8")
    lines = re.findall(r"^curl .*$", readme, re.MULTILINE)
    assert len(lines) >= 5
    (tmp_path / "scene.glb").write_bytes(glb(triangle))
    (tmp_path / "scene.gltf").write_bytes(triangle)
    (tmp_path / "scene.bin").write_bytes(b"")
    (tmp_path / "mine.json").write_text(json.dumps(PROFILE), encoding="utf-8")
    for line in lines:
        small = line.replace(SERVED, server.url).replace(
            "scenes/builtin:spheres", "scenes/builtin:spheres%3Ftriangles=1000"
        )
        small = small.replace("curl ", "curl --fail-with-body --silent --show-error ")
        done = subprocess.run(
            ["bash", "-c", small], cwd=tmp_path, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, f"{line}: {done.stderr} {done.stdout}"
    subprocess.run(
        [
            sys.executable, "-m", "lfd_render.cli.main", "render",
            "builtin:spheres?triangles=1000", "-o", "cli.png",
        ],
        cwd=tmp_path,
        check=True,
        env=os.environ | {"NO_COLOR": "1"},
        capture_output=True,
    )  # fmt: skip
    assert (tmp_path / "eia.png").read_bytes() == (tmp_path / "cli.png").read_bytes()


def glb(gltf: bytes) -> bytes:
    """The file of a glTF document that needs no other."""
    body = gltf + b" " * (-len(gltf) % 4)
    chunk = struct.pack("<I4s", len(body), b"JSON") + body
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunk)) + chunk


def test_all_settings_are_told() -> None:
    told = (REPOSITORY / "docs" / "service.md").read_text(encoding="utf-8")
    missing = [row for row in Settings.table() if row not in told]
    assert not missing, "docs/service.md should have\n" + "\n".join(missing)

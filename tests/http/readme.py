"""The README's curl lines, run against a server of any kind."""

import json
import os
import re
import struct
import subprocess
import sys
from pathlib import Path

from .conftest import PROFILE

REPOSITORY = Path(__file__).resolve().parents[2]
SERVED = "http://127.0.0.1:8000"


def run_readme(url: str, triangle: bytes, folder: Path) -> None:
    """Each line succeeds, and the panel image is the command line's, bit for bit."""
    readme = (REPOSITORY / "README.md").read_text(encoding="utf-8")
    lines = re.findall(r"^curl .*$", readme, re.MULTILINE)
    assert len(lines) >= 5
    (folder / "scene.glb").write_bytes(glb(triangle))
    (folder / "scene.gltf").write_bytes(triangle)
    (folder / "scene.bin").write_bytes(b"")
    (folder / "mine.json").write_text(json.dumps(PROFILE), encoding="utf-8")
    for line in lines:
        small = line.replace(SERVED, url).replace(
            "scenes/builtin:spheres", "scenes/builtin:spheres%3Ftriangles=1000"
        )
        small = small.replace("curl ", "curl --fail-with-body --silent --show-error ")
        done = subprocess.run(
            ["bash", "-c", small], cwd=folder, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, f"{line}: {done.stderr} {done.stdout}"
    subprocess.run(
        [
            sys.executable, "-m", "lfd_render.cli.main", "render",
            "builtin:spheres?triangles=1000", "-o", "cli.png",
        ],
        cwd=folder,
        check=True,
        env=os.environ | {"NO_COLOR": "1"},
        capture_output=True,
    )  # fmt: skip
    assert (folder / "eia.png").read_bytes() == (folder / "cli.png").read_bytes()


def glb(gltf: bytes) -> bytes:
    """The file of a glTF document that needs no other."""
    body = gltf + b" " * (-len(gltf) % 4)
    chunk = struct.pack("<I4s", len(body), b"JSON") + body
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunk)) + chunk

"""A real server in a process of its own, and the small things that are sent to it."""

import base64
import json
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from threading import Thread
from typing import Any

import httpx
import numpy as np
import pytest

SCENE = "builtin:spheres?triangles=1000"
PATH = "/v1/scenes/builtin:spheres%3Ftriangles=1000"
GLTF = {"Content-Type": "model/gltf+json"}
# 192 × 108 pixels, 8 views, 30°.
PROFILE: dict[str, Any] = {
    "schema": "lfd-display/1",
    "name": "small",
    "panel": {
        "resolution_px": [192, 108],
        "size_mm": [96.0, 54.0],
        "subpixels": {"layout": "stripe", "order": "rgb", "origin": "red-at-pixel-centre"},
    },
    "lens": {"lens_count": 24.3, "drift": -0.05, "center": 0.2, "index": 1.49},
    "viewing": {"views": 8, "cone_deg": 30.0, "distance_mm": 400.0, "spacing": "lens"},
}


@dataclass
class Server:
    """A running server. log: the JSON lines that it wrote, once it has ended."""

    process: subprocess.Popen[str]
    url: str
    log: list[str]
    data: Path = Path()

    def client(self, **options: Any) -> httpx.Client:
        return httpx.Client(base_url=self.url, timeout=60, trust_env=False, **options)

    def render_pids(self) -> list[int]:
        """The render processes."""
        tasks = Path(f"/proc/{self.process.pid}/task").iterdir()
        texts = [(task / "children").read_text(encoding="ascii") for task in tasks]
        return [int(pid) for text in texts for pid in text.split()]


Start = Callable[..., AbstractContextManager[Server]]


@contextmanager
def serving(
    *arguments: str, python_path: Path | None = None, **settings: object
) -> Iterator[Server]:
    """`lfd-render serve` on a free port, with settings of the environment."""
    environment = {f"LFD_{name.upper()}": str(value) for name, value in settings.items()}
    if python_path:
        environment["PYTHONPATH"] = str(python_path)
    with subprocess.Popen(
        [sys.executable, "-m", "lfd_render.cli.main", "serve", "--port", "0", *arguments],
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | environment,
    ) as process:
        log: list[str] = []
        try:
            url = _address(process)
            assert process.stderr is not None
            reading = Thread(target=log.extend, args=(process.stderr,))
            reading.start()
            yield Server(process, url, log)
        finally:
            process.terminate()
        reading.join()  # until the server has ended


def _address(process: subprocess.Popen[str]) -> str:
    assert process.stderr is not None
    said = []
    for line in process.stderr:
        said.append(line)
        if match := re.match(r"listening on (http://\S+)", line):
            return match[1]
    raise AssertionError("".join(said))


@pytest.fixture(scope="session")
def start() -> Start:
    """``with start("--processes", "2", deadline_s=5) as server:`` starts one."""
    return serving


@pytest.fixture(scope="module")
def server(start: Start) -> Iterator[Server]:
    """One with two render processes, for the tests of a module."""
    with start("--processes", "2") as server:
        yield server


@pytest.fixture
def client(server: Server) -> Iterator[httpx.Client]:
    with server.client() as client:
        yield client


@pytest.fixture(scope="session")
def profile() -> dict[str, Any]:
    """A small display."""
    return PROFILE


@pytest.fixture(scope="session")
def triangle() -> bytes:
    """A glTF file of one triangle."""
    positions = np.array([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], "<f4")
    data = base64.b64encode(positions.tobytes()).decode()
    limits = {"min": [-1, -1, 0], "max": [1, 1, 0]}
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", **limits}
        ],
        "bufferViews": [{"buffer": 0, "byteLength": positions.nbytes}],
        "buffers": [
            {"uri": f"data:application/octet-stream;base64,{data}", "byteLength": positions.nbytes}
        ],
    }
    return json.dumps(document).encode()


@pytest.fixture
def small(client: httpx.Client, profile: dict[str, Any]) -> str:
    """The name of the small display on the server."""
    client.put("/v1/displays/small", json=profile).raise_for_status()
    return "small"

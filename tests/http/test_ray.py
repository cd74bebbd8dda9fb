"""The application on Ray Serve answers as the server does."""

import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from .conftest import PATH, PROFILE
from .readme import run_readme

pytestmark = [pytest.mark.needs("gl"), pytest.mark.needs("ray")]
SERVE = """
import sys
import ray
from ray import serve
from lfd_render.service.ray_app import build

ray.init(address="local", num_cpus=2, include_dashboard=False, log_to_driver=False)
serve.start(http_options={"host": "127.0.0.1", "port": int(sys.argv[1])})
serve.run(build({"processes": 1}))
print("ready", flush=True)
sys.stdin.read()
serve.shutdown()
"""


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    """The address of the application on a cluster of its own, of two cores."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    with subprocess.Popen(
        [sys.executable, "-c", SERVE, str(port)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    ) as process:
        assert process.stdout is not None
        assert any(line == "ready\n" for line in process.stdout)
        yield f"http://127.0.0.1:{port}"


@pytest.mark.needs("curl")
@pytest.mark.shows("Ray Serve: the README's curl lines, on two cores")
def test_the_readmes_lines_on_ray_serve(url: str, triangle: bytes, tmp_path: Path) -> None:
    run_readme(url, triangle, tmp_path)


def test_problems_streams_and_jobs_on_ray_serve(url: str) -> None:
    with httpx.Client(base_url=url, timeout=60, trust_env=False) as client:
        missing = client.get("/v1/scenes/none/eia")
        assert (missing.status_code, missing.json()["field"]) == (404, "scene")
        client.put("/v1/displays/small", json=PROFILE).raise_for_status()
        stream = client.get(f"{PATH}/stream?display=small&frames=3&fps=60")
        assert stream.content.count(b"LFD-Frame") > 1
        picture = {"picture": "eia", "scene": "builtin:spheres", "display": PROFILE}
        later = client.post("/v1/render", json=picture, headers={"Prefer": "respond-async"})
        assert later.status_code == 202
        assert b'"state":"done"' in client.get(f"{later.headers['location']}/events").content

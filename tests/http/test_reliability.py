"""Under too much, too long, too little room, and at its end, the server loses nothing."""

import asyncio
import contextlib
import json
import os
import resource
import signal
import socket
import subprocess
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from .conftest import GLTF, PATH, PROFILE, Server, Start

pytestmark = pytest.mark.needs("gl")
CHEAP = Path(__file__).parent / "cheap"
MIB = 1 << 20
Scaled = Callable[[int, int], int]
Measured = Callable[[str, str], None]


@pytest.fixture
def takes_100_ms(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LFD_CHEAP_MS", "100")


@pytest.fixture
def takes_20_ms(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LFD_CHEAP_MS", "20")


def until(condition: Callable[[], bool]) -> None:
    late = time.monotonic() + 30
    while not condition():
        assert time.monotonic() < late, "it never came"
        time.sleep(0.02)


def idle(client: httpx.Client) -> bool:
    ready = client.get("/readyz").json()
    return bool(ready["running"] == ready["queued"] == 0)


def place(client: httpx.Client) -> None:
    client.put("/v1/displays/small", json=PROFILE).raise_for_status()


@pytest.mark.shows("4 x overload: only 200, or 429 with Retry-After; health stays quick")
def test_overload(start: Start, takes_100_ms: None, scaled: Scaled, measured: Measured) -> None:
    seconds, capacity = scaled(600, 4), 2 / 0.1
    found: Counter[str] = Counter()
    health: list[float] = []

    async def ask(client: httpx.AsyncClient, number: int) -> None:
        answer = await client.get(f"{PATH}/eia", params={"display": "small", "yaw": number / 100})
        assert answer.status_code == 200 or int(answer.headers["retry-after"]) > 0
        found[str(answer.status_code)] += 1

    async def probe(client: httpx.AsyncClient) -> None:
        while True:
            started = time.perf_counter()
            (await client.get("/livez")).raise_for_status()
            health.append(1000 * (time.perf_counter() - started))
            await asyncio.sleep(0.02)

    async def overload(url: str) -> float:
        limits = httpx.Limits(max_connections=1000, max_keepalive_connections=1000)
        options: Any = {"base_url": url, "timeout": 60, "trust_env": False, "limits": limits}
        async with httpx.AsyncClient(**options) as client, httpx.AsyncClient(**options) as other:
            probing = asyncio.create_task(probe(other))
            started = time.monotonic()
            async with asyncio.TaskGroup() as group:
                for number in range(round(4 * capacity * seconds)):
                    await asyncio.sleep(started + number / (4 * capacity) - time.monotonic())
                    group.create_task(ask(client, number))
            probing.cancel()
            return time.monotonic() - started

    with start("--processes", "2", python_path=CHEAP, queue=16) as server:
        with server.client() as client:
            place(client)
        took = asyncio.run(overload(server.url))
    assert set(found) == {"200", "429"}
    assert found.total() == round(4 * capacity * seconds)  # none was lost
    measured("4 x overload", f"{found['200']} x 200, {found['429']} x 429, none lost")
    measured("goodput", f"{found['200'] / took / capacity:.0%} of what sleeping processes could do")
    measured("/livez under it", f"p99 {np.percentile(health, 99):.0f} ms")


@pytest.mark.shows("1,000 clients that go: all called off, no place leaked")
def test_clients_that_go(start: Start, takes_20_ms: None, scaled: Scaled) -> None:
    count = scaled(1000, 150)
    with start("--processes", "2", python_path=CHEAP, queue=64) as server:
        host, port = "127.0.0.1", httpx.URL(server.url).port
        with server.client() as client:
            place(client)

            def go(number: int) -> None:
                path = ("eia", "stream", "look")[number % 3]
                with socket.create_connection((host, port)) as raw:
                    query = f"display=small&yaw={number}"
                    head = f"GET {PATH}/{path}?{query} HTTP/1.1\r\nHost: localhost\r\n\r\n"
                    raw.sendall(head.encode())
                    time.sleep(number % 7 / 200)

            with ThreadPoolExecutor(8) as threads:
                list(threads.map(go, range(count)))
            until(lambda: idle(client))
            assert "lfd_streams 0.0" in client.get("/metrics").text
            assert client.get(f"{PATH}/eia?display=small").status_code == 200
            sockets = [link for link in links(server.process.pid) if link.startswith("socket:")]
            # Its own and this client's, those to the render processes, and no other.
            assert len(sockets) < 16


def links(pid: int) -> Iterator[str]:
    for file in Path(f"/proc/{pid}/fd").iterdir():
        try:
            yield os.readlink(file)
        except OSError:
            continue


@pytest.fixture
def tiny_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 2 MiB."""
    folder = tmp_path / "disk"
    folder.mkdir()
    made = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=2m", "tmpfs", folder], capture_output=True, check=False
    )
    if made.returncode:
        pytest.skip(f"[mount] may not mount a file system: {made.stderr.decode().strip()}")
    yield folder
    subprocess.run(["umount", "--lazy", folder], check=True)


@pytest.mark.shows("disk full: 507, recovers, no partial file")
def test_a_full_disk(
    start: Start, tiny_disk: Path, triangle: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TMPDIR", str(tiny_disk))  # where EXR files pass through
    exr = {"Accept": "image/x-exr"}
    large = triangle[:-1] + b" " * 3 * MIB + b"}"
    raw = {"Prefer": "respond-async", "Accept": "application/octet-stream"}
    with start(data_dir=tiny_disk) as server, server.client() as client:
        place(client)
        assert client.post("/v1/scenes", content=large, headers=GLTF).status_code == 507
        until(lambda: not list((tiny_disk / "scenes").iterdir()))
        assert client.post("/v1/scenes", content=triangle, headers=GLTF).status_code == 201
        assert client.get(f"{PATH}/eia?display=small", headers=exr).status_code == 200
        filler = tiny_disk / "filler"
        with filler.open("wb") as file, pytest.raises(OSError, match="No space"):
            file.write(bytes(4 * MIB))
        full = client.put("/v1/displays/other", json=PROFILE)
        assert (full.status_code, full.headers["content-type"]) == (507, "application/problem+json")
        assert client.get("/v1/displays/other").status_code == 404
        later = client.get(f"{PATH}/eia?display=small", headers=raw).headers["location"]
        until(lambda: client.get(later).json()["state"] == "failed")
        assert client.get(f"{later}/result").status_code == 507
        assert client.get(f"{PATH}/eia?display=small&yaw=2", headers=exr).status_code == 507
        assert client.get(f"{PATH}/eia?display=small").status_code == 200  # nothing is kept of it
        filler.unlink()
        assert client.put("/v1/displays/other", json=PROFILE).status_code == 201
        again = client.get(f"{PATH}/eia?display=small&yaw=1", headers=raw).headers["location"]
        until(lambda: client.get(again).json()["state"] == "done")
        assert len(client.get(f"{again}/result").content) == 3 * 192 * 108
        names = {path.name for path in tiny_disk.rglob("[!.]*") if path.is_file()}
        assert names == {"small.json", "other.json", "scene.json", "scene.gltf", "0"}


def test_no_file_descriptors(start: Start, triangle: bytes) -> None:
    """Uploads are refused, and a picture whose process cannot be replaced is made when it can."""
    with start("--processes", "1") as server, server.client() as client:
        place(client)
        pid = server.process.pid
        most, hard = resource.prlimit(pid, resource.RLIMIT_NOFILE)
        taken = 1 + max(int(file.name) for file in Path(f"/proc/{pid}/fd").iterdir())
        resource.prlimit(pid, resource.RLIMIT_NOFILE, (taken, hard))
        full = client.post("/v1/scenes", content=triangle, headers=GLTF)
        assert (full.status_code, full.headers["retry-after"]) == (503, "5")
        with ThreadPoolExecutor() as threads:
            making = threads.submit(client.get, f"{PATH}/eia?display=small")
            time.sleep(1)
            resource.prlimit(pid, resource.RLIMIT_NOFILE, (most, hard))
            assert making.result().status_code == 200
        assert client.post("/v1/scenes", content=triangle, headers=GLTF).status_code == 201


def grown(server: Server) -> int:
    """Bytes by which the render process grows over many frames of many scenes."""
    frames, scenes = 10_000, 100
    with server.client() as client:
        place(client)

        def render(count: int) -> int:
            """Its least size over the last tenth of so many frames: what comes and goes is none."""
            (pid,), sizes = server.render_pids(), []
            for frame in range(count):
                scene = f"builtin:spheres%3Ftriangles={1000 + frame * scenes // count}"
                query = f"display=small&yaw={frame}"
                client.get(f"/v1/scenes/{scene}/eia?{query}").raise_for_status()
                if frame >= count * 9 // 10:
                    statm = Path(f"/proc/{pid}/statm").read_text(encoding="ascii")
                    sizes.append(int(statm.split()[1]) * 4096)
            return min(sizes)

        return -render(frames // 2) + render(frames)


CACHELESS = {"scene_cache_mb": 64, "frame_cache_mb": 0, "answer_cache_mb": 0}


@pytest.fixture
def many(full_counts: bool) -> None:
    """It takes some hundred frames until the allocator has settled, and minutes to see growth."""
    if not full_counts:
        pytest.skip("[LFD_FULL=1] is for full counts alone")


@pytest.mark.shows("leak: 10,000 frames over 100 scenes; a planted leak is caught")
def test_frames_leave_no_memory(start: Start, many: None, measured: Measured) -> None:
    with start("--processes", "1", **CACHELESS) as server:
        growth = grown(server)
    measured("growth of a render process", f"{growth / MIB:.2f} MiB")
    assert growth <= MIB


def test_a_planted_leak_is_caught(
    start: Start, many: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("LFD_CHEAP_LEAK", "300")
    with start("--processes", "1", python_path=CHEAP, **CACHELESS) as server:
        assert grown(server) > MIB


@pytest.mark.shows("SIGTERM under load: none dropped")
def test_the_end_under_load(
    start: Start, takes_20_ms: None, scaled: Scaled, measured: Measured
) -> None:
    found: Counter[str] = Counter()
    for _ in range(scaled(20, 2)):
        with start("--processes", "2", python_path=CHEAP) as server:
            with server.client() as client:
                place(client)

            def load(number: int, server: Server = server) -> None:
                turn = 0
                while True:
                    turn += 1
                    with server.client() as own:
                        url = f"{PATH}/eia?display=small&yaw={number + turn / 1000}"
                        try:
                            found[str(own.get(url).status_code)] += 1
                        except httpx.ConnectError:
                            return  # it no longer listens
                        except httpx.TransportError as error:
                            found[type(error).__name__] += 1

            threads = [threading.Thread(target=load, args=(n,)) for n in range(8)]
            for thread in threads:
                thread.start()
            time.sleep(0.5)
            server.process.send_signal(signal.SIGTERM)
            for thread in threads:
                thread.join(60)
                assert not thread.is_alive()
    measured("requests while the server was told to end", json.dumps(found))
    assert set(found) == {"200"}


def test_clients_that_say_nothing_are_hung_up_on(start: Start) -> None:
    """Silent ones, ones that end amid the first line, and ones whose body only drips."""
    drip = b"POST /v1/scenes HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: model/gltf+json\r\n"
    with start(python_path=CHEAP, idle_s=1) as server, server.client() as client:
        where = (client.base_url.host, client.base_url.port)
        with (
            socket.create_connection(where, timeout=10) as silent,
            socket.create_connection(where, timeout=10) as half,
            socket.create_connection(where, timeout=10) as dripping,
        ):
            half.sendall(b"GET /livez HT")
            dripping.sendall(drip + b"Content-Length: 1000\r\n\r\n")
            started = time.monotonic()
            dripping.settimeout(0.1)
            answer = b""
            while not answer and time.monotonic() - started < 8:
                dripping.sendall(b" ")
                try:
                    answer = dripping.recv(100)
                except TimeoutError:
                    client.get("/livez").raise_for_status()  # one that asks is kept
            assert answer.startswith(b"HTTP/1.1 408")
            for mute in (silent, half):
                with contextlib.suppress(ConnectionResetError):
                    assert mute.recv(1) == b""


def test_an_address_has_so_many_connections(start: Start) -> None:
    with start(python_path=CHEAP, max_connections=3) as server, server.client() as client:
        where = (client.base_url.host, client.base_url.port)
        client.get("/livez").raise_for_status()
        with socket.create_connection(where), socket.create_connection(where) as last:
            with socket.create_connection(where, timeout=10) as more:
                assert more.recv(100).startswith(b"HTTP/1.1 429")
            client.get("/livez").raise_for_status()
            last.close()

            def again() -> bool:
                with socket.create_connection(where, timeout=10) as more:
                    more.sendall(b"GET /livez HTTP/1.1\r\nHost: localhost\r\n\r\n")
                    return more.recv(100).startswith(b"HTTP/1.1 200")

            until(again)


def test_kept_pictures_keep_no_descriptors(start: Start) -> None:
    with start(python_path=CHEAP) as server, server.client() as client:
        place(client)
        files = Path(f"/proc/{server.process.pid}/fd")
        before = len(list(files.iterdir()))
        for turn in range(40):
            client.get(f"{PATH}/eia", params={"display": "small", "yaw": turn}).raise_for_status()
        again = client.get(f"{PATH}/eia", params={"display": "small", "yaw": 3})
        assert "frame" not in again.headers.get("server-timing", "")  # it was kept
        assert len(list(files.iterdir())) < before + 20


def test_what_a_killed_deletion_left_is_cleared(
    start: Start, triangle: bytes, tmp_path: Path
) -> None:
    with start(python_path=CHEAP, data_dir=tmp_path) as server, server.client() as client:
        scene = client.post("/v1/scenes", content=triangle, headers=GLTF).json()["id"]
    (tmp_path / "scenes" / scene / "scene.json").unlink()
    with start(python_path=CHEAP, data_dir=tmp_path) as server, server.client() as client:
        assert client.get(f"/v1/scenes/{scene}").status_code == 404
        assert client.post("/v1/scenes", content=triangle, headers=GLTF).status_code == 201


def test_scenes_that_cannot_be_read_are_left_alone(
    start: Start, triangle: bytes, tmp_path: Path
) -> None:
    """Another version's, say, whose facts have other names or kinds."""
    content = (triangle, triangle + b" ")
    others = ({"later": 1}, {"facts": {"bounds": "large"}})

    def uploaded(client: httpx.Client, number: int) -> httpx.Response:
        return client.post("/v1/scenes", content=content[number], headers=GLTF)

    with start(python_path=CHEAP, data_dir=tmp_path) as server, server.client() as client:
        scenes = [uploaded(client, number).json()["id"] for number in range(2)]
    told = [tmp_path / "scenes" / scene / "scene.json" for scene in scenes]
    ours = told[0].read_text("utf-8")
    for file, other in zip(told, others, strict=True):
        file.write_text(json.dumps(json.loads(file.read_text("utf-8")) | other), "utf-8")
    with start(python_path=CHEAP, data_dir=tmp_path) as server, server.client() as client:
        for scene in scenes:
            assert client.get(f"/v1/scenes/{scene}").status_code == 404
        assert client.get("/v1/scenes").status_code == 200
        assert all(file.exists() for file in told)
        assert uploaded(client, 1).status_code == 201
        assert client.get(f"/v1/scenes/{scenes[1]}").status_code == 200
    told[0].write_text(ours, "utf-8")
    with start(python_path=CHEAP, data_dir=tmp_path) as server, server.client() as client:
        for scene in scenes:
            assert client.get(f"/v1/scenes/{scene}").status_code == 200


def test_scenes_that_do_not_fit_are_refused_before_they_come(start: Start, triangle: bytes) -> None:
    """Bytes that others are sending count as theirs, and so many may send at a time."""

    def fill(size: int) -> bytes:
        return triangle[:-1] + b" " * (size - len(triangle)) + b"}"

    limits = {"max_scenes_mb": 1, "max_uploads": 2, "max_upload_mb": 1}
    with start(python_path=CHEAP, **limits) as server, server.client() as client:

        def begun(size: int) -> socket.socket:
            """An upload of which only the first lines come."""
            raw = socket.create_connection((client.base_url.host, client.base_url.port or 0))
            head = "POST /v1/scenes HTTP/1.1\r\nHost: localhost\r\nContent-Type: model/obj\r\n"
            raw.sendall(f"{head}Content-Length: {size}\r\n\r\n".encode())
            raw.settimeout(0.3)
            return raw

        def upload(size: int) -> int:
            return client.post("/v1/scenes", content=fill(size), headers=GLTF).status_code

        with begun(700_000) as one, pytest.raises(TimeoutError):
            one.recv(1)  # it is waited for
        until(lambda: upload(400_000) == 201)
        with begun(400_000) as one, begun(1_000) as two:
            for each in (one, two):
                with pytest.raises(TimeoutError):
                    each.recv(1)
            assert upload(2_000) == 429
            two.close()
            until(lambda: upload(400_000) == 200)  # it is there
            with begun(300_000) as three:
                assert three.recv(12) == b"HTTP/1.1 507"
        until(lambda: upload(300_000) == 201)
        assert upload(400_001) == 507

"""What render processes and clients do wrong costs nobody else a picture."""

import json
import os
import signal
import socket
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import httpx
import pytest

from .conftest import GLTF, PATH, PROFILE, Server, Start
from .faults.sitecustomize import BREAK, CRASH, EAT, HANG, LOSE, MUTE, SLOW, SWELL

pytestmark = pytest.mark.needs("gl")
FAULTS = Path(__file__).parent / "faults"


@pytest.fixture(scope="module")
def server(start: Start, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """One whose render processes fail on demand."""
    folder = tmp_path_factory.mktemp("data")
    settings = {
        "deadline_s": 12,
        "grace_s": 1,
        "process_memory_mb": 1024,
        "data_dir": folder,
    }
    with start("--processes", "2", python_path=FAULTS, **settings) as server:
        server.data = folder
        with server.client() as client:
            small = {**PROFILE, "name": "small"}
            client.put("/v1/displays/small", json=small).raise_for_status()
        yield server


def metric(client: httpx.Client, name: str) -> float:
    lines = client.get("/metrics").text.splitlines()
    return float(next(line for line in lines if line.startswith(f"{name} ")).split()[-1])


def until(condition: Callable[[], bool], seconds: float = 30) -> None:
    ends = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < ends, "it never came"
        time.sleep(0.05)


def eia(client: httpx.Client, scene: str = PATH, **query: object) -> httpx.Response:
    return client.get(f"{scene}/eia", params={"display": "small", **query})


def problem(response: httpx.Response, status: int) -> dict[str, Any]:
    assert response.status_code == status, response.text
    assert response.headers["content-type"] == "application/problem+json"
    found: dict[str, Any] = response.json()
    assert found["status"] == status
    return found


def scene(number: int) -> str:
    """A scene of its own, so that no test blocks another's."""
    return f"/v1/scenes/builtin:chart%3Ftriangles={1000 + number}"


@pytest.mark.shows("kill -9 of a render process under load loses no request")
def test_killed_processes_lose_no_request(
    server: Server, client: httpx.Client, scaled: Callable[[int, int], int],
    measured: Callable[[str, str], None],
) -> None:  # fmt: skip
    kills, done = scaled(100, 5), threading.Event()
    statuses: list[int] = []
    slowest = 0.0

    def load(number: int) -> None:
        with server.client() as own:
            turn = 0
            while not done.is_set():
                turn += 1
                statuses.append(eia(own, yaw=number + turn / 100).status_code)

    def probe() -> None:
        nonlocal slowest
        with server.client() as own:
            while not done.is_set():
                started = time.perf_counter()
                assert own.get("/livez").status_code == 200
                slowest = max(slowest, time.perf_counter() - started)
                time.sleep(0.01)

    restarts = "lfd_process_restarts_total"
    before = metric(client, restarts)
    with ThreadPoolExecutor(5) as threads:
        working = [threads.submit(load, number) for number in range(4)]
        working.append(threads.submit(probe))
        try:
            for kill in range(kills):
                os.kill(server.render_pids()[kill % 2], signal.SIGKILL)
                until(lambda: metric(client, restarts) == before + kill + 1)  # noqa: B023
                until(lambda: client.get("/readyz").json()["processes_ready"] == 2)
        finally:
            done.set()
        for each in working:
            each.result()
    assert set(statuses) == {200}
    measured("killed processes", f"{kills}, {len(statuses)} requests, none lost")
    measured("slowest /livez meanwhile", f"{1000 * slowest:.0f} ms")


def test_a_scene_that_crashes_is_refused(server: Server, client: httpx.Client) -> None:
    pids = server.render_pids()
    before = metric(client, "lfd_process_restarts_total")
    assert "so ends the process" in problem(eia(client, scene(1), seed=CRASH), 422)["detail"]
    assert metric(client, "lfd_process_restarts_total") - before == 2
    ended = set(pids) - set(server.render_pids())
    temporary = Path(tempfile.gettempdir())
    assert ended
    assert not [left for pid in ended for left in temporary.glob(f"lfd-render-{pid}-*")]
    assert "is refused" in problem(eia(client, scene(1)), 422)["detail"]
    assert metric(client, "lfd_process_restarts_total") - before == 2
    assert eia(client, scene(2)).status_code == 200


def test_a_scene_that_hangs_meets_its_deadline(client: httpx.Client) -> None:
    before = metric(client, "lfd_process_restarts_total")
    with ThreadPoolExecutor() as threads:
        query = {"display": "small", "seed": HANG}
        hurry = {"Prefer": "wait=2"}
        late = threads.submit(client.get, f"{scene(3)}/eia", params=query, headers=hurry)
        assert eia(client, scene(4), yaw=1).status_code == 200
        problem(late.result(), 504)
    # It is ended when it has had the time of any picture, and another takes its place.
    until(lambda: metric(client, "lfd_process_restarts_total") == before + 1)
    until(lambda: client.get("/readyz").json()["processes_ready"] == 2)


def test_what_one_order_does_to_a_scene_is_not_the_others_fault(start: Start) -> None:
    """An order whose process hangs twice is refused, another of the same scene is not; and an
    encoder has the time that its picture takes, though it says nothing meanwhile."""
    settings = {"deadline_s": 1, "grace_s": 0.2, "python_path": FAULTS}
    with start("--processes", "1", **settings) as server, server.client() as client:
        client.put("/v1/displays/small", json=PROFILE).raise_for_status()
        restarts = "lfd_process_restarts_total"

        def ready() -> bool:
            told = client.get("/readyz").json()
            return bool(told["processes_ready"] == 1 and told["running"] == 0)

        large = {"display": "small", "size": "4000x3000", "seed": MUTE}  # 6 s of WebP
        problem(client.get(f"{PATH}/look", params=large, headers={"Accept": "image/webp"}), 504)
        until(ready)
        assert metric(client, restarts) == 0
        for count in (1, 2):
            problem(eia(client, seed=HANG), 504)
            until(lambda: metric(client, restarts) == count)  # noqa: B023
            until(ready)
        assert "other options" in problem(eia(client, seed=HANG), 422)["detail"]
        assert client.get(f"{PATH}/eia?display=small&seed=3").status_code in (200, 504)
        assert metric(client, restarts) == 2


def test_a_scene_that_eats_memory_is_told_so(client: httpx.Client) -> None:
    assert "out of memory" in problem(eia(client, scene(5), seed=EAT), 413)["detail"]


def test_a_process_that_grows_too_large_is_ended(client: httpx.Client) -> None:
    before = metric(client, "lfd_process_restarts_total")
    problem(eia(client, scene(7), seed=SWELL), 422)
    assert metric(client, "lfd_process_restarts_total") - before == 2


def test_a_process_whose_device_fails_is_replaced(client: httpx.Client) -> None:
    before = metric(client, "lfd_process_restarts_total")
    told = eia(client, scene(8), seed=LOSE)
    assert int(told.headers["retry-after"]) >= 1
    problem(told, 503)
    until(lambda: metric(client, "lfd_process_restarts_total") == before + 1)
    until(lambda: client.get("/readyz").json()["processes_ready"] == 2)
    assert eia(client, scene(8)).status_code == 200


def test_what_nobody_expected_is_logged_not_told(server: Server, client: httpx.Client) -> None:
    told = problem(eia(client, scene(6), seed=BREAK), 500)
    assert "planted" not in json.dumps(told)
    until(lambda: any("ZeroDivisionError: planted" in line for line in server.log))


@pytest.mark.shows("client disconnect cancels")
def test_a_client_that_goes_calls_its_picture_off(server: Server, client: httpx.Client) -> None:
    before = metric(client, 'lfd_jobs_total{outcome="cancelled"}')
    for number in range(3):
        with socket.create_connection(("127.0.0.1", httpx.URL(server.url).port)) as raw:
            query = f"display=small&seed={SLOW}&yaw={number}"
            raw.sendall(f"GET {PATH}/eia?{query} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
            until(lambda: client.get("/readyz").json()["running"] == 1)
        until(lambda: client.get("/readyz").json()["running"] == 0)
    assert metric(client, 'lfd_jobs_total{outcome="cancelled"}') - before == 3


def test_more_than_the_queue_holds_is_asked_to_come_again(start: Start) -> None:
    with start("--processes", "1", queue=4, deadline_s=60, python_path=FAULTS) as server:
        with server.client() as client:
            client.put("/v1/displays/small", json=PROFILE).raise_for_status()

        def one(number: int) -> httpx.Response:
            with server.client() as own:
                return eia(own, yaw=number)

        with ThreadPoolExecutor(50) as threads:
            found = list(threads.map(one, range(50)))
    assert {response.status_code for response in found} == {200, 429}
    for response in found:
        if response.status_code == 429:
            problem(response, 429)
            assert int(response.headers["retry-after"]) >= 1


def test_a_scene_deleted_while_it_renders(
    server: Server, client: httpx.Client, triangle: bytes
) -> None:
    told = client.post("/v1/scenes", content=triangle, headers=GLTF).json()
    url = f"/v1/scenes/{told['id']}"
    assert (server.data / "scenes" / told["id"]).is_dir()
    with ThreadPoolExecutor() as threads:
        rendering = threads.submit(eia, client, url, seed=SLOW)
        until(lambda: client.get("/readyz").json()["running"] == 1)
        assert client.delete(url).status_code == 204
        problem(eia(client, url), 404)
        assert rendering.result().status_code == 200
    until(lambda: not (server.data / "scenes" / told["id"]).exists())
    problem(client.delete(url), 404)


def test_two_uploads_of_one_scene(server: Server, client: httpx.Client, triangle: bytes) -> None:
    def upload(_: int) -> httpx.Response:
        with server.client() as own:
            return own.post("/v1/scenes", content=triangle, headers=GLTF)

    with ThreadPoolExecutor(4) as threads:
        found = list(threads.map(upload, range(4)))
    assert sorted(response.status_code for response in found) == [200, 200, 200, 201]
    ids = {response.json()["id"] for response in found}
    listed = [each["id"] for each in client.get("/v1/scenes").json()["scenes"]]
    assert len(ids) == 1
    assert [listed.count(one) for one in ids] == [1]
    assert client.delete(f"/v1/scenes/{ids.pop()}").status_code == 204


def test_what_is_being_made_is_made_before_the_server_ends(start: Start) -> None:
    with start("--processes", "1", python_path=FAULTS) as server, server.client() as client:
        client.put("/v1/displays/small", json=PROFILE).raise_for_status()
        with ThreadPoolExecutor() as threads:
            making = [threads.submit(eia, client, seed=SLOW, yaw=number) for number in range(3)]
            until(lambda: client.get("/readyz").json()["queued"] == 2)
            server.process.terminate()
            assert [each.result().status_code for each in making] == [200] * 3
        server.process.wait(20)

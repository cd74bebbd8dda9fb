"""Streams: every frame is the picture of its moment, and one who does not read costs nothing."""

import io
import json
import re
import signal
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from PIL import Image
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from .conftest import PATH, Server, Start

pytestmark = pytest.mark.needs("gl")
PANEL = (192, 108)


def parts(response: httpx.Response) -> Iterator[tuple[int, bytes]]:
    """Numbers and pictures of a multipart stream."""
    boundary = response.headers["content-type"].partition("boundary=")[2]
    body = b""
    for piece in response.iter_raw():
        body += piece
        while match := re.match(
            rb"(?:\r\n)?--%b\r\nContent-Type: image/jpeg\r\nContent-Length: (\d+)\r\n"
            rb"LFD-Frame: (\d+)\r\n\r\n" % boundary.encode(),
            body,
        ):
            end = match.end() + int(match[1])
            if len(body) < end:
                break
            yield int(match[2]), body[match.end() : end]
            body = body[end:]


def levels(jpeg: bytes) -> np.ndarray[Any, np.dtype[np.int16]]:
    return np.array(Image.open(io.BytesIO(jpeg)), np.int16)


def player(server: Server, query: str, **options: Any) -> ClientConnection:
    url = f"{server.url.replace('http', 'ws')}{PATH}/stream?{query}"
    return connect(url, max_size=None, **options)


def until(true: Callable[[], bool]) -> None:
    """Wait for something that is to happen soon."""
    late = time.monotonic() + 20
    while not true():
        assert time.monotonic() < late
        time.sleep(0.05)


def gauge(client: httpx.Client, name: str) -> float:
    match = re.search(rf"^{name} (\S+)$", client.get("/metrics").text, re.MULTILINE)
    assert match
    return float(match[1])


@pytest.mark.parametrize("motion", ["eye", "orbit", "sway"])
def test_people_see_the_panel_move(client: httpx.Client, small: str, motion: str) -> None:
    moving = {"motion": motion, "fps": 20, "period": 2, "swing": 10, "frames": 8}
    query = {"display": small, "yaw": 5}
    with client.stream("GET", f"{PATH}/stream", params=query | moving) as response:
        assert response.status_code == 200
        frames = list(parts(response))
    numbers = [number for number, _ in frames]
    assert numbers == sorted(set(numbers))
    assert numbers[0] == 0
    assert len(frames) > 1
    for number, picture in frames:
        turn = number / 20 / 2
        swing = 10 * np.sin(2 * np.pi * turn)
        shown = {
            "eye": {"angle": swing}, "orbit": {"yaw": 5 + 360 * turn}, "sway": {"yaw": 5 + swing},
        }[motion]  # fmt: skip
        told = client.get(f"{PATH}/look", params=query | shown, headers={"Accept": "image/jpeg"})
        # The sine of another library may differ in its last place: a level or two.
        assert np.abs(levels(picture) - levels(told.content)).max() <= 2


def test_players_get_exact_frames(server: Server, client: httpx.Client, small: str) -> None:
    with player(server, f"display={small}&fps=30&period=3&frames=30") as socket:
        count = 0
        for line in socket:
            told, picture = json.loads(line), socket.recv()
            asked = {"display": small, "yaw": told["yaw"]}
            assert client.get(f"{PATH}/eia", params=asked).content == picture
            assert told["bytes"] == len(picture)
            count += 1
            with suppress(ConnectionClosed):  # after the last one
                socket.send(json.dumps({"ack": told["frame"]}))
        assert count > 1
        assert socket.close_code == 1000


def test_a_player_leads_the_camera(server: Server, client: httpx.Client, small: str) -> None:
    query = f"display={small}&motion=none&fps=60&media=application/octet-stream"
    with player(server, query) as socket:
        for yaw in (None, 20.0, -7.5):
            if yaw is not None:
                socket.send(json.dumps({"yaw": yaw, "pitch": 3}))
            told, picture = json.loads(socket.recv()), socket.recv()
            assert (told["size"], len(picture)) == ([*PANEL], 3 * PANEL[0] * PANEL[1])
            asked = {"display": small, "yaw": told["yaw"], "pitch": told["pitch"]}
            raw = {"Accept": "application/octet-stream"}
            assert client.get(f"{PATH}/eia", params=asked, headers=raw).content == picture
            assert told["yaw"] == (yaw or 0)
            socket.send(json.dumps({"ack": told["frame"]}))
        with pytest.raises(TimeoutError):
            socket.recv(timeout=0.3)  # nothing moves


def test_the_last_change_while_frames_are_on_their_way_is_the_next(
    server: Server, small: str
) -> None:
    """None is made of where the camera was meanwhile."""
    with player(server, f"display={small}&motion=none&fps=60") as socket:

        def frame() -> dict[str, Any]:
            told = json.loads(socket.recv())
            socket.recv()
            return dict(told)

        frame()
        socket.send(json.dumps({"yaw": 1}))
        second = frame()  # and two are on their way
        for yaw in (2, 3, 4):
            socket.send(json.dumps({"yaw": yaw}))
            with pytest.raises(TimeoutError):
                socket.recv(timeout=0.1)
        socket.send(json.dumps({"ack": second["frame"]}))
        assert (second["yaw"], frame()["yaw"]) == (1, 4)
        with pytest.raises(TimeoutError):
            socket.recv(timeout=0.2)


def test_sockets_are_in_the_log(server: Server, small: str) -> None:
    with player(server, f"display={small}&frames=1", additional_headers={"X-Request-Id": "mine"}):
        pass

    def told() -> list[dict[str, Any]]:
        lines = [json.loads(line) for line in server.log]
        return [line for line in lines if line.get("request_id") == "mine"]

    until(lambda: bool(told()))
    (line,) = told()
    assert line["method"] == "WEBSOCKET"
    assert 1000 <= line["status"] < 1010


@pytest.mark.parametrize(
    ("query", "message", "status", "field"),
    [
        ("display=none", None, 404, "display"),
        ("fps=0", None, 422, "fps"),
        ("display=small&view_size=9", None, 422, "view_size"),
        ("display=small&camera=none", None, 422, "camera"),
        ("display=small", "{", 422, "message"),
        ("display=small", '{"yaw": NaN}', 422, "yaw"),
        ("display=small", '{"yaw": "1"}', 422, "yaw"),
        ("display=small", '{"ack": "0"}', 422, "ack"),
        ("display=small", '{"shader": "void main() {}"}', 422, "shader"),
    ],
)
def test_a_player_is_told_what_is_wrong(
    server: Server, small: str, query: str, message: str | None, status: int, field: str
) -> None:
    with player(server, query) as socket:
        if message is not None:
            socket.recv(), socket.recv()
            socket.send(message)
        while isinstance(told := socket.recv(), bytes) or "problem" not in told:
            pass
        problem = json.loads(told)["problem"]
        assert (problem["status"], problem["field"]) == (status, field)
        with pytest.raises(ConnectionClosed):
            socket.recv()
        assert socket.close_code == 1008


def test_pages_elsewhere_cannot_play(server: Server) -> None:
    with pytest.raises(Exception, match="403"):
        player(server, "", origin="https://example.org")


def test_who_stops_reading_leaves_nothing_behind(start: Start, profile: dict[str, Any]) -> None:
    """Neither a place, a render process nor a connection, over HTTP and over sockets."""
    with (
        start("--processes", "1", idle_s=1.5) as server,
        server.client() as client,
        socket.socket() as deaf,
    ):
        client.put("/v1/displays/small", json=profile)
        # Few kilobytes fit between the two, so that the server soon waits for its reader.
        deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        host, port = server.url.removeprefix("http://").split(":")
        deaf.connect((host, int(port)))
        query = "display=small&fps=60&size=1280x720"
        deaf.sendall(f"GET {PATH}/stream?{query} HTTP/1.1\r\nHost: {host}\r\n\r\n".encode())
        with player(server, "display=small&fps=60") as mute:  # never acknowledges
            until(lambda: gauge(client, "lfd_streams") == 2)
            mute.recv(), mute.recv()
            seen = [mute.recv(), mute.recv()]
            until(lambda: gauge(client, "lfd_streams") == 0)
            until(lambda: gauge(client, "lfd_running") == 0)
            assert "problem" in mute.recv()
        assert len(seen) == 2
        peer = f"{deaf.getsockname()[1]:04X}"
        until(lambda: peer not in connections(server))


def connections(server: Server) -> list[str]:
    """Far ends' ports, in hex, of the server's connections as the kernel lists them."""
    port = f"{int(server.url.rpartition(':')[2]):04X}"
    table = Path(f"/proc/{server.process.pid}/net/tcp").read_text(encoding="ascii")
    ends = [line.split()[1:3] for line in table.splitlines()[1:]]
    return [far.partition(":")[2] for near, far in ends if near.endswith(f":{port}")]


def test_streams_end_with_the_server(start: Start, profile: dict[str, Any]) -> None:
    """Long before the time that pictures get: a multipart stream, a player, a job's events."""
    with start("--processes", "2", drain_s=60) as server, server.client() as client:
        client.put("/v1/displays/small", json=profile)
        job = client.post(
            "/v1/jobs",
            json={"pictures": [{
                "picture": "look", "scene": "builtin:spheres", "display": profile,
                "sweep": "-10:10:1000", "size": "320x180",
            }]},
        ).headers["location"]  # fmt: skip
        with (
            client.stream("GET", f"{PATH}/stream?display=small") as pictures,
            client.stream("GET", f"{job}/events") as events,
            player(server, "display=small") as socket,
        ):
            seen, told = pictures.iter_raw(), events.iter_raw()
            next(seen), next(told), socket.recv()
            started = time.monotonic()
            server.process.send_signal(signal.SIGTERM)
            for _ in seen:
                pass
            for _ in told:
                pass
            for _ in socket:
                pass
            server.process.wait()
        assert time.monotonic() - started < 30  # of the 60 that pictures would get

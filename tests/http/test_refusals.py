"""What is refused, with which status, naming what: bad input, strangers, too much of anything."""

import asyncio
import io
import json
import socket
import struct
import subprocess
import sys
import zlib
from collections.abc import Iterator
from typing import Any

import httpx
import pytest
from lfd_render.service.guards import Keys
from lfd_render.service.run import _listening
from lfd_render.service.settings import Settings
from starlette.types import Message, Receive, Scope, Send

from lfd_render.errors import UsageError

from .conftest import GLTF, PATH, PROFILE, SCENE, Server, Start

pytestmark = pytest.mark.needs("gl")
KEY = "a key of the tests"
WIDE = PROFILE | {"panel": PROFILE["panel"] | {"resolution_px": [4096, 4096]}}


@pytest.fixture(scope="module")
def server(start: Start) -> Iterator[Server]:
    """One with small limits, without keys."""
    limits = {"max_upload_mb": 2, "max_texels": 1 << 20, "max_triangles": 5000}
    pixels = {"max_view_pixels": 1 << 24, "max_picture_pixels": 1 << 23}
    with start(max_scenes=3, **limits, **pixels) as server:
        with server.client() as client:
            client.put("/v1/displays/small", json=PROFILE).raise_for_status()
            client.put("/v1/displays/wide", json=WIDE).raise_for_status()
        yield server


@pytest.fixture(scope="module")
def guarded(start: Start) -> Iterator[Server]:
    """One that asks for a key, and for patience."""
    keys = f"another,{KEY}"
    with start(api_keys=keys, rate_per_minute=72, cors_origins="https://shop.example") as server:
        yield server


def problem(response: httpx.Response, status: int) -> dict[str, Any]:
    assert response.status_code == status, response.text
    assert response.headers["content-type"] == "application/problem+json"
    found: dict[str, Any] = response.json()
    assert found["status"] == status
    assert found["request_id"] == response.headers["x-request-id"]
    return found


@pytest.mark.parametrize(
    ("query", "status", "field"),
    [
        ("viewz=3", 422, "viewz"),
        ("views=many", 422, "views"),
        ("views=0", 422, "views"),
        ("yaw=nan", 422, "yaw"),
        ("pitch=inf", 422, "pitch"),
        ("technique=magic", 422, "technique"),
        ("supersample=9", 400, "supersample"),
        ("exposure=bright", 400, "exposure"),
        ("view_size=0x4", 422, "view_size"),
        ("focus_distance=3", 400, "focus_distance"),
        ("environment=/etc/passwd", 422, "environment"),
        ("technique=mvr&lattice=paper", 400, "lattice"),
        ("display=nowhere", 404, "display"),
        ("display=../../etc/passwd", 422, "display"),
        ("display=auto", 404, "display"),
        ("camera=nobody", 422, "camera"),
        ("views=1024&view_size=9000x9000", 413, "views"),
        ("display=small&supersample=16x16", 413, "views"),
        ("display=wide", 422, "display"),
    ],
)
def test_queries_are_checked(client: httpx.Client, query: str, status: int, field: str) -> None:
    assert problem(client.get(f"{PATH}/eia?{query}"), status).get("field") == field


@pytest.mark.parametrize(
    ("query", "media", "field", "remedy"),
    [
        ("view?view_size=3000x3000", "image/png", "view_size", "limit is 8388608"),
        ("views?view_size=3000x3000&views=1", "application/zip", "view_size", "limit is 8388608"),
        ("quilt?tiles=1x1&size=3000x3000", "image/png", "size", "limit is 8388608"),
        ("quilt?tiles=1x1&size=20000x1", "image/webp", "size", "16383 pixels a side"),
        ("look?sweep=-9:9:300&size=60x60", "image/webp", "sweep", "16383 pixels a side"),
        ("look?sweep=-9:9:400&size=300x1", "image/jpeg", "sweep", "65500 pixels a side"),
        ("look?display=wide", "image/png", "display", "limit is 8388608"),
    ],
)
def test_pictures_are_bounded(
    client: httpx.Client, query: str, media: str, field: str, remedy: str
) -> None:
    """Before they are queued; what one encoding takes is all that nobody can call off."""
    place, _, options = query.partition("?")
    query = options if "display" in options else f"display=small&{options}"
    found = client.get(f"{PATH}/{place}?{query}", headers={"Accept": media})
    told = problem(found, 422)
    assert told["field"] == field
    assert remedy in told["detail"]


@pytest.mark.parametrize("what", ["map", "pattern"])
def test_panels_are_bounded(client: httpx.Client, what: str) -> None:
    assert problem(client.get(f"/v1/displays/wide/{what}"), 422)["field"] == "display"


@pytest.mark.parametrize(
    ("path", "status"),
    [
        ("/nowhere", 404),
        ("/v1/scenes/nothing/eia", 404),
        ("/v1/scenes/builtin:nothing/eia", 404),
        ("/v1/scenes/builtin:spheres%3Ftriangles=1/eia", 404),
        ("/v1/scenes/builtin:spheres%3Ftriangles=6000/eia", 413),
        ("/v1/scenes/builtin:gallery%3Ftriangles=1000&textures=4096/eia", 413),
        ("/v1/scenes/..%2F..%2Fetc/eia", 404),
        ("/v1/displays/nowhere", 404),
        ("/v1/displays/nowhere/map", 404),
        (f"{PATH}/look?display=small&angle=1&eye=0,0,500", 400),
        (f"{PATH}/view?display=small&index=8", 400),
        (f"{PATH}/quilt?display=small&tiles=7x3&size=100x100", 400),
    ],
)
def test_places_are_checked(client: httpx.Client, path: str, status: int) -> None:
    problem(client.get(path), status)


@pytest.mark.parametrize(
    ("body", "status", "field"),
    [
        ("{", 422, "body"),
        ("[]", 422, "body"),
        ('{"picture": "eia"}', 422, "scene"),
        ('{"picture": "film", "scene": "builtin:spheres"}', 422, "body"),
        ('{"picture": "eia", "scene": "builtin:spheres", "yaw": NaN}', 422, "yaw"),
        ('{"picture": "eia", "scene": "builtin:spheres", "yaw": 1e999}', 422, "yaw"),
        ('{"picture": "eia", "scene": "builtin:spheres", "yaw": "3"}', 422, "yaw"),
        ('{"picture": "eia", "scene": "builtin:spheres", "views": 3.5}', 422, "views"),
        ('{"picture": "eia", "scene": "builtin:spheres", "shader": "void main"}', 422, "shader"),
        (
            '{"picture": "eia", "scene": "builtin:spheres", "display": {"schema": 3}}',
            422,
            "display",
        ),
        ('{"picture": "eia", "scene": "builtin:spheres", "camera": {"a": 3}}', 422, "camera"),
        ('{"picture": "eia", "scene": "' + "x" * 200 + '"}', 422, "scene"),
        ("[" * 100_000, 400, None),
        (b"\xff\xfe\x00", 400, None),
        ("x" * (5 << 20), 413, "body"),
    ],
)
def test_bodies_are_checked(
    client: httpx.Client, body: str | bytes, status: int, field: str | None
) -> None:
    headers = {"Content-Type": "application/json"}
    told = problem(client.post("/v1/render", content=body, headers=headers), status)
    assert told.get("field") == field


def test_what_the_device_lacks_is_no_fault_of_the_server(client: httpx.Client) -> None:
    found = client.get(f"{PATH}/eia?display=small&splat=int64")
    if found.status_code != 200:  # a graphics card may have it
        assert problem(found, 422)["field"] == "splat"


def test_bodies_of_unknown_length_are_counted(client: httpx.Client) -> None:
    pieces = (b"x" * 65536 for _ in range(80))
    headers = {"Content-Type": "application/json"}
    problem(client.post("/v1/render", content=pieces, headers=headers), 413)


@pytest.mark.parametrize(
    "name", ["../a.bin", "/etc/a.bin", "a/../../b.bin", "a\\b.bin", "a//b", ""]
)
def test_side_files_stay_in_their_folder(client: httpx.Client, triangle: bytes, name: str) -> None:
    files = [("files", ("scene.gltf", triangle)), ("files", (name, b"data"))]
    problem(client.post("/v1/scenes", files=files), 422)


def test_forms_are_checked(client: httpx.Client, triangle: bytes) -> None:
    one = ("files", ("a.gltf", triangle))
    two = ("files", ("b.gltf", triangle))
    assert problem(client.post("/v1/scenes", files=[one, one]), 422)["field"] == "files"
    assert problem(client.post("/v1/scenes", files=[one, two]), 422)["field"] == "files"
    chosen = client.post("/v1/scenes", files=[one, two], data={"main": "b.gltf"})
    assert chosen.json()["main"] == "b.gltf"
    client.delete(chosen.headers["location"]).raise_for_status()
    wrong = client.post("/v1/scenes", files=[one], data={"main": "c.gltf"})
    assert problem(wrong, 422)["field"] == "main"
    problem(client.post("/v1/scenes", files=[("files", ("a.txt", b"x"))]), 422)
    for charset in ("undefined", "utf-7", "unicode_escape"):
        odd = {"Content-Type": f"multipart/form-data; boundary=x; charset={charset}"}
        problem(client.post("/v1/scenes", content=b"--x\r\n", headers=odd), 415)
    broken = {"Content-Type": "multipart/form-data; boundary=x"}
    problem(client.post("/v1/scenes", content=b"--y\r\n", headers=broken), 400)
    problem(client.post("/v1/scenes", content=b"x", headers={"Content-Type": "text/plain"}), 415)


def png(width: int, height: int) -> bytes:
    """A picture of one colour, deflated a thousandfold."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        body = kind + data
        return struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))

    header = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
    rows = zlib.compress(bytes(3 * width + 1) * height, 9)
    return b"\x89PNG\r\n\x1a\n" + header + chunk(b"IDAT", rows) + chunk(b"IEND", b"")


OBJ = b"mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"


@pytest.mark.parametrize(
    ("files", "status"),
    [
        ({"a.glb": b""}, 422),
        ({"a.glb": b"glTF" + bytes(40)}, 422),
        ({"a.glb": bytes(3 << 20)}, 413),
        ({"a.gltf": b'{"asset": {"version": "2.0"}, "cameras": [{"name": "\\ud800"}]}'}, 422),
        ({"a.gltf": b'{"asset": {"version": "2.0"}, "nodes": [{"children": [0]}]}'}, 422),
        ({"a.obj": b"f 1 2 3\n"}, 422),
        ({"a.obj": b"v 0 0 0\nv 1 0 0\nv 0 1 0\n" + b"f 1 2 3\n" * 6000}, 413),
        ({"a.obj": OBJ, "a.mtl": b"newmtl m\nmap_Kd a.png\n", "a.png": png(4000, 4000)}, 413),
        ({"a.obj": OBJ, "a.mtl": b"newmtl m\nmap_Kd a.png\n", "a.png": b"II*\0" + bytes(90)}, 422),
    ],
    ids=[
        "empty",
        "no GLB",
        "large",
        "half a character",
        "cycle",
        "no vertices",
        "triangles",
        "bomb",
        "TIFF",
    ],
)
def test_bad_scenes_leave_nothing(
    client: httpx.Client, files: dict[str, bytes], status: int
) -> None:
    parts = [("files", (name, io.BytesIO(data))) for name, data in files.items()]
    told = problem(client.post("/v1/scenes", files=parts), status)
    assert "/tmp" not in told["detail"]
    assert "lfd-render-" not in told["detail"]
    assert all(
        each["id"].startswith("builtin:") for each in client.get("/v1/scenes").json()["scenes"]
    )


def test_scenes_are_bounded(client: httpx.Client, triangle: bytes) -> None:
    made = []
    for number in range(3):
        content = triangle + b" " * number
        made.append(client.post("/v1/scenes", content=content, headers=GLTF).headers["location"])
    problem(client.post("/v1/scenes", content=triangle + b"    ", headers=GLTF), 507)
    assert client.post("/v1/scenes", content=triangle, headers=GLTF).status_code == 200  # is there
    for place in made:
        assert client.delete(place).status_code == 204


def test_displays_are_kept_and_checked(client: httpx.Client) -> None:
    assert client.put("/v1/displays/mine", json=PROFILE).status_code == 201
    assert client.put("/v1/displays/mine", json=PROFILE).status_code == 200
    kept = client.get("/v1/displays/mine")
    assert kept.json()["lens"] == PROFILE["lens"]
    for tags in (kept.headers["etag"], f'"other", W/{kept.headers["etag"]}', "*"):
        unchanged = client.get("/v1/displays/mine", headers={"If-None-Match": tags})
        assert unchanged.status_code == 304
    converted = client.post("/v1/convert-display", json={"display": "mine", "to": "van-berkel"})
    assert json.loads(converted.json()["text"])
    bad = json.loads(json.dumps(PROFILE))
    bad["lens"]["lens_count"] = -3
    told = problem(client.put("/v1/displays/mine", json=bad), 422)
    assert "lens.lens_count" in told["detail"]
    problem(client.put("/v1/displays/gavane-2024-tilted-4k", json=PROFILE), 409)
    problem(client.delete("/v1/displays/gavane-2024-tilted-4k"), 409)
    problem(client.put("/v1/displays/auto", json=PROFILE), 409)
    assert client.delete("/v1/displays/mine").status_code == 204
    problem(client.get("/v1/displays/mine"), 404)


def test_odd_methods_make_no_series(client: httpx.Client) -> None:
    problem(client.request("PROPFIND", "/v1/displays"), 405)
    told = client.get("/metrics").text
    assert 'method="other"' in told
    assert "PROPFIND" not in told


def test_methods_and_media_are_checked(client: httpx.Client) -> None:
    problem(client.post(f"{PATH}/eia"), 405)
    told = client.get(f"{PATH}/eia?display=small", headers={"Accept": "text/html, image/gif"})
    assert problem(told, 406)["field"] == "Accept"
    none = client.get(f"{PATH}/eia?display=small", headers={"Accept": "image/png;q=0, text/*"})
    problem(none, 406)


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Host": "evil.example"}, 421),
        ({"Host": "evil.example:8000"}, 421),
        ({"Origin": "http://evil.example"}, 403),
        ({"Origin": "null"}, 403),
        ({"Sec-Fetch-Site": "cross-site"}, 403),
        ({"Sec-Fetch-Site": "same-site", "Sec-Fetch-Dest": "image"}, 403),
        ({"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Dest": "iframe"}, 403),
        ({"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Dest": "document"}, 403),
        ({"Sec-Fetch-Site": "same-origin"}, 200),
        ({"Host": "localhost:8000", "Origin": "http://localhost:8000"}, 200),
        ({}, 200),
    ],
)
def test_pages_elsewhere_cannot_drive_the_server(
    client: httpx.Client, headers: dict[str, str], status: int
) -> None:
    assert client.get("/v1/displays", headers=headers).status_code == status


def test_links_elsewhere_lead_to_the_page(client: httpx.Client) -> None:
    followed = {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Dest": "document"}
    assert client.get("/", headers=followed).status_code == 200
    assert client.get("/docs").status_code == 404  # whose viewer would come from elsewhere


def test_keys_are_asked_for(guarded: Server) -> None:
    with guarded.client() as client:
        assert client.get("/livez").status_code == client.get("/readyz").status_code == 200
        for headers in ({}, {"X-API-Key": "wrong"}, {"Authorization": f"Basic {KEY}"}):
            told = client.get("/v1/displays", headers=headers)
            problem(told, 401)
            assert told.headers["www-authenticate"] == "Bearer"
        for headers in ({"X-API-Key": KEY}, {"Authorization": "Bearer another"}):
            assert client.get("/v1/displays", headers=headers).status_code == 200
        assert all(KEY not in line for line in guarded.log)


def statuses_of(
    settings: Settings,
    clients: list[tuple[str | None, str | None]],
    server: tuple[str, int | None] = ("127.0.0.1", 8000),
) -> list[int]:
    """What clients of these addresses are answered, each with what a proxy says of it."""
    statuses: list[int] = []
    keys = Keys(_answers, settings)

    async def send(message: Message) -> None:
        statuses.extend([message["status"]] if "status" in message else [])

    async def receive() -> Message:
        return {"type": "http.request"}

    for address, told in clients:
        headers = [(b"x-forwarded-for", told.encode())] if told else []
        scope: Scope = {"type": "http", "path": "/v1/displays", "headers": headers}
        scope["client"] = address and (address, 9)
        scope["server"] = server
        asyncio.run(keys(scope, receive, send))
    return statuses


async def _answers(scope: Scope, receive: Receive, send: Send) -> None:
    await send({"type": "http.response.start", "status": 200})


def test_strangers_need_a_key() -> None:
    addresses = ("192.0.2.7", "::ffff:192.0.2.7", "127.0.0.1", "::1")
    found = statuses_of(Settings(), [(address, None) for address in addresses])
    assert found == [403, 403, 200, 200]


def test_a_socket_file_is_this_machines() -> None:
    """But for whom a proxy speaks there; and a stranger who has gone has no address either."""
    clients = [(None, None), (None, "192.0.2.7")]
    assert statuses_of(Settings(), clients, ("/run/lfd.sock", None)) == [200, 403]
    assert statuses_of(Settings(), clients) == [403, 403]


def test_addresses_of_this_machine_share_a_rate() -> None:
    """A client without a key may call itself 127.0.0.2 in X-Forwarded-For, or so be called."""
    once = Settings(rate_per_minute=6)
    assert statuses_of(once, [("127.0.0.1", None), ("127.0.0.2", None)]) == [200, 429]


def test_idempotency_keys_are_each_clients_own(guarded: Server) -> None:
    frame = {"picture": "eia", "scene": SCENE, "display": PROFILE}
    found = []
    with guarded.client() as client:
        for seed, key in enumerate((KEY, "another")):
            headers = {"X-API-Key": key, "Idempotency-Key": "turn"}
            body = {"pictures": [frame | {"seed": seed}]}
            found.append(client.post("/v1/jobs", json=body, headers=headers))
    assert [answer.status_code for answer in found] == [202, 202]
    assert found[0].json()["id"] != found[1].json()["id"]


def test_pages_that_are_allowed_may(guarded: Server) -> None:
    origin = {"Origin": "https://shop.example"}
    with guarded.client() as client:
        asked = origin | {"Access-Control-Request-Method": "POST"}
        assert client.options("/v1/render", headers=asked).status_code == 200
        found = client.get("/v1/displays", headers=origin | {"X-API-Key": "another"})
        assert found.headers["access-control-allow-origin"] == origin["Origin"]


def test_a_key_has_its_rate(guarded: Server) -> None:
    with guarded.client(headers={"X-API-Key": KEY}) as client:
        found = [client.get("/v1/displays") for _ in range(40)]
        refused = [response for response in found if response.status_code != 200]
        assert len(found) - len(refused) >= 9  # twelve at once, less those of the tests before
        for response in refused:
            problem(response, 429)
            assert int(response.headers["retry-after"]) >= 1
        assert refused


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("PORT", "high"),
        ("PROCESSES", "0"),
        ("DEADLINE_S", "nan"),
        ("QUEUE", "-1"),
        ("API_KEYS", "é"),
    ],
)
def test_settings_are_checked(name: str, value: str) -> None:
    with pytest.raises(UsageError, match=f"LFD_{name}: .*'{value}'"):
        Settings.from_environment({f"LFD_{name}": value})


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (("--host", "0.0.0.0"), 2, "LFD_API_KEYS"),
        (("--data-dir", "/proc/nowhere"), 8, "LFD_DATA_DIR: /proc/nowhere"),
        (("--device", "99"), 5, "EGL device 99"),
    ],
)
def test_a_server_that_cannot_start_says_why(
    arguments: tuple[str, ...], code: int, words: str
) -> None:
    command = [sys.executable, "-m", "lfd_render.cli.main", "serve", "--port", "0", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == code
    assert words in done.stderr.splitlines()[-1]
    assert "Traceback" not in done.stderr


def test_answers_wait_for_no_acknowledgement() -> None:
    """Of a first packet, for which a client's kernel takes its time, before the second goes."""
    with (
        _listening(Settings(port=0)) as listener,
        socket.create_connection(listener.getsockname()),
        listener.accept()[0] as connection,
    ):
        assert connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)


def test_what_is_described_is_there(client: httpx.Client) -> None:
    described = client.get("/openapi.json").json()
    assert "Problem" in described["components"]["schemas"]
    for path, methods in described["paths"].items():
        for operation in methods.values():
            assert operation["responses"], path
            refused = operation["responses"]["500"]["content"]
            assert list(refused) == ["application/problem+json"]
    picture = described["paths"]["/v1/scenes/{scene}/eia"]["get"]
    assert "image/png" in picture["responses"]["200"]["content"]

"""Pictures over HTTP are the command line's and the Python API's, to the bit."""

import io
import json
import zipfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from lfd_render.service.fields import EiaQuery, ViewsQuery
from PIL import Image

from lfd_render import DisplayProfile, Renderer, Scene, look
from lfd_render.cli.bundle import PANEL_IMAGE
from lfd_render.engine.choices import Choices
from lfd_render.renderer import camera_for

from .conftest import PATH, SCENE, Server

pytestmark = pytest.mark.needs("gl")


@pytest.fixture(scope="module")
def display(profile: dict[str, Any]) -> DisplayProfile:
    return DisplayProfile.from_json(json.dumps(profile))


@pytest.fixture(scope="module")
def scene() -> Scene:
    return Scene.load(SCENE)


def pixels(response: httpx.Response) -> np.ndarray[Any, np.dtype[np.uint8]]:
    assert response.status_code == 200, response.text
    return np.array(Image.open(io.BytesIO(response.content)).convert("RGB"))


def test_a_panel_image_is_the_files_of_python(
    client: httpx.Client, small: str, device: Any, scene: Scene, display: DisplayProfile,
    tmp_path: Path,
) -> None:  # fmt: skip
    query = {"display": small, "views": 6, "aa": "both", "supersample": "2x1", "seed": 3}
    found = client.get(f"{PATH}/eia", params=query | {"yaw": 20, "pitch": -10, "exposure": "1EV"})
    camera = camera_for(scene, display).turned(np.deg2rad(20), np.deg2rad(-10))
    eia = Renderer(device).render(
        scene, display, camera, views=6, aa="both", supersample=(2, 1), seed=3, exposure=2.0,
        linear=False,
    )  # fmt: skip
    eia.save(tmp_path / "eia.png")
    assert found.content == (tmp_path / "eia.png").read_bytes()


def test_formats_hold_the_same_pixels(client: httpx.Client, small: str) -> None:
    url = f"{PATH}/eia?display={small}"
    png = pixels(client.get(url))
    assert png.shape == (108, 192, 3)
    assert np.array_equal(pixels(client.get(url, headers={"Accept": "image/webp"})), png)
    raw = client.get(url, headers={"Accept": "application/octet-stream"})
    assert raw.content == png.tobytes()
    assert raw.headers["lfd-size"] == "192x108"
    exr = client.get(url, headers={"Accept": "image/x-exr"})
    assert exr.content.startswith(b"\x76\x2f\x31\x01")
    assert client.get(url, headers={"Accept": "image/jpeg"}).status_code == 406
    jpeg = client.get(f"{url}&lossy=true", headers={"Accept": "image/jpeg"})
    assert jpeg.content.startswith(b"\xff\xd8\xff")


def test_an_eye_sees_what_look_shows(
    client: httpx.Client, small: str, device: Any, scene: Scene, display: DisplayProfile
) -> None:
    eia = Renderer(device).render(scene, display)
    found = client.get(f"{PATH}/look", params={"display": small, "angle": 7})
    assert np.array_equal(pixels(found), look(eia.pixels, display, np.deg2rad(7)))
    other = client.get(f"{PATH}/look", params={"display": small, "eye": "-40,0,400"})
    assert not np.array_equal(pixels(other), pixels(found))
    assert "frame" not in other.headers["server-timing"]  # the panel image was there already


def test_views_one_by_one_and_together(
    client: httpx.Client, small: str, device: Any, scene: Scene, display: DisplayProfile
) -> None:
    expected = Renderer(device).views(scene, display, view_size=(24, 16))
    query = {"display": small, "view_size": "24x16"}
    archive = zipfile.ZipFile(io.BytesIO(client.get(f"{PATH}/views", params=query).content))
    assert archive.namelist() == [f"view_{n:03d}.png" for n in range(8)]
    for index, name in enumerate(archive.namelist()):
        assert np.array_equal(np.array(Image.open(archive.open(name))), expected[index])
    # Alone it shares nothing with others, as all do by rays.
    alone = Renderer(device).views(scene, display, view_size=(24, 16), shade="ray")
    one = client.get(f"{PATH}/view", params=query | {"index": 5})
    assert np.array_equal(pixels(one), alone[5])
    quilt = pixels(client.get(f"{PATH}/quilt?display={small}&tiles=4x2&size=96x32"))
    assert np.array_equal(quilt[16:, 24:48], expected[1])  # view 0 bottom-left


def test_a_post_spells_out_display_and_camera(
    client: httpx.Client, small: str, profile: dict[str, Any], scene: Scene,
    display: DisplayProfile,
) -> None:  # fmt: skip
    camera = camera_for(scene, display).to_json_dict()
    body = {"picture": "eia", "scene": SCENE, "display": profile, "camera": camera, "views": 8}
    told = client.post("/v1/render", json=body)
    assert told.content == client.get(f"{PATH}/eia?display={small}&views=8").content


def test_unchanged_pictures_are_not_sent_again(client: httpx.Client, small: str) -> None:
    url = f"{PATH}/eia?display={small}"
    first = client.get(url)
    again = client.get(url, headers={"If-None-Match": f'"other", {first.headers["etag"]}'})
    assert (again.status_code, again.content) == (304, b"")
    assert again.headers["etag"] == first.headers["etag"]
    head = client.head(url)
    assert (head.status_code, head.content) == (200, b"")
    assert head.headers["etag"] == first.headers["etag"]
    other = client.get(f"{url}&yaw=1", headers={"If-None-Match": first.headers["etag"]})
    assert other.status_code == 200


@pytest.mark.shows("two clients with different displays on one scene get right pictures")
def test_two_clients_with_two_displays(
    server: Server, client: httpx.Client, small: str, profile: dict[str, Any], device: Any,
    scene: Scene,
) -> None:  # fmt: skip
    other = json.loads(json.dumps(profile))
    other["lens"] |= {"lens_count": 31.7, "drift": 0.1}
    other["viewing"]["views"] = 5
    client.put("/v1/displays/other", json=other).raise_for_status()
    asked = [(name, yaw) for yaw in range(8) for name in (small, "other")]

    def one(name: str, yaw: int) -> bytes:
        with server.client() as own:
            query = {"display": name, "yaw": yaw}
            return own.get(f"{PATH}/eia", params=query).raise_for_status().content

    with ThreadPoolExecutor(4) as threads:
        found = list(threads.map(lambda each: one(*each), asked))
    displays = {n: DisplayProfile.from_json(json.dumps(p)) for n, p in
                ((small, profile), ("other", other))}  # fmt: skip
    assert len(set(found)) == len(asked)
    renderer = Renderer(device)
    for (name, yaw), picture in zip(asked, found, strict=True):
        display = displays[name]
        camera = camera_for(scene, display).turned(np.deg2rad(yaw))
        expected = renderer.render(scene, display, camera)
        assert np.array_equal(np.array(Image.open(io.BytesIO(picture))), expected.pixels)


def test_a_helmet_goes_through(client: httpx.Client, small: str, assets: Path) -> None:
    paths = sorted((assets / "FlightHelmet").iterdir())
    files = [("files", (path.name, path.read_bytes())) for path in paths]
    made = client.post("/v1/scenes", files=files)
    assert made.status_code == 201
    assert made.json()["triangles"] == 94722
    seen = pixels(client.get(f"{made.headers['location']}/look", params={"display": small}))
    assert seen.std() > 20


def test_options_have_one_list() -> None:
    chosen = set(Choices.__dataclass_fields__)
    assert set(PANEL_IMAGE) == chosen
    of_http = set(EiaQuery.model_fields) - {"display", "lossy"}
    assert of_http == chosen
    assert chosen - {"lookup", "weave", "aa", "aa_light", "splat"} <= set(ViewsQuery.model_fields)

"""The page as a person uses it, in a Chromium without a window."""

import base64
import io
import json
import os
import struct
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from playwright.sync_api import Browser, Page, Route, expect, sync_playwright

from lfd_render import DisplayProfile
from lfd_render.display.calibration.by_eye import adjusted
from lfd_render.display.patterns import view_grating
from lfd_render.gpu import system

from .conftest import Server, Start

pytestmark = [pytest.mark.needs("gl"), pytest.mark.needs("browser")]

SCENE = "builtin:spheres?triangles=10000"
PANEL = (192, 108)
# The first full-screen in a test waits for a panel image on a busy machine.
PATIENCE_MS = 60_000
_PIXELS = """canvas => {
  const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
  const text = Array.from(data, (code) => String.fromCharCode(code)).join("");
  return [canvas.width, canvas.height, btoa(text)];
}"""
Pixels = NDArray[np.uint8]
Open = Callable[..., Page]
Launch = Callable[..., AbstractContextManager[Browser]]


@pytest.fixture(scope="module")
def server(start: Start) -> Iterator[Server]:
    with start() as server:
        yield server


@pytest.fixture(scope="module")
def launch() -> Iterator[Launch]:
    """``with launch("--some-option") as browser:`` starts one."""
    # Chromium keeps root from its sandbox.
    needed = ["--no-sandbox"] if os.geteuid() == 0 else []

    @contextmanager
    def launch(*options: str) -> Iterator[Browser]:
        browser = playwright.chromium.launch(
            executable_path=system.browser_path(), args=[*needed, *options]
        )
        yield browser
        browser.close()

    with sync_playwright() as playwright:
        yield launch


@pytest.fixture(scope="module")
def browser(launch: Launch) -> Iterator[Browser]:
    with launch() as browser:
        yield browser


@pytest.fixture
def visit(browser: Browser, server: Server, small: str) -> Iterator[Open]:
    """``visit("calibrate", viewport=(192, 108))`` opens a page and waits for its first picture. In
    the end nothing may have been thrown on it."""
    contexts, thrown = [], []

    def visit(
        path: str = f"?display=small&scene={SCENE.replace('?', '%3F')}",
        *,
        url: str = server.url,
        viewport: tuple[int, int] = (1280, 900),
        ratio: float = 1,
        wait: bool = True,
    ) -> Page:
        size = {"width": viewport[0], "height": viewport[1]}
        context = browser.new_context(
            viewport=size, screen=size, device_scale_factor=ratio, accept_downloads=True
        )  # type: ignore[arg-type]
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(PATIENCE_MS)
        page.on("pageerror", lambda error: thrown.append(str(error)))
        page.goto(f"{url}/{path}")
        if wait:
            rest(page)
        return page

    yield visit
    for context in contexts:
        context.close()
    assert thrown == []


def rest(page: Page) -> None:
    """Wait until the page has shown what was last wanted."""
    page.wait_for_timeout(450)  # a hand that rests so long is done
    expect(page.locator("#stage")).to_have_attribute("aria-busy", "false", timeout=PATIENCE_MS)


def shown(page: Page, selector: str = "#picture") -> Pixels:
    """The pixels of a canvas."""
    width, height, text = page.locator(selector).evaluate(_PIXELS)
    return np.frombuffer(base64.b64decode(text), np.uint8).reshape(height, width, 4)[..., :3]


def pixels(data: bytes) -> Pixels:
    return np.array(Image.open(io.BytesIO(data)).convert("RGB"))


def placed(page: Page) -> dict[str, str]:
    """What the page's address says is shown."""
    return dict(httpx.URL(page.url).params)


def picture(client: httpx.Client, kind: str, **query: Any) -> bytes:
    """The API's picture."""
    scene = query.pop("scene", SCENE).replace("?", "%3F")
    found = client.get(f"/v1/scenes/{scene}/{kind}", params={"display": "small"} | query)
    assert found.status_code == 200, found.text
    return found.content


def seen(client: httpx.Client, page: Page, **query: Any) -> Pixels:
    """What the API shows of what the page says it shows."""
    return pixels(picture(client, "look", **placed(page) | {"eye": "0,0,400"} | query))


def two_squares() -> bytes:
    """A GLB: a small red square before a large blue one."""
    square = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    corners = [square * 0.15 + (0, 0, 0.5), square - (0, 0, 0.5)]
    data = b"".join(part.astype("<f4").tobytes() for part in corners)
    colours = [[1, 0, 0], [0, 0, 1]]
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"mesh": 0}, {"mesh": 1}],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": n}, "material": n}]} for n in range(2)
        ],
        "materials": [
            {
                "emissiveFactor": colour,
                "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1]},
                "doubleSided": True,
            }
            for colour in colours
        ],
        "accessors": [
            {
                "bufferView": n, "componentType": 5126, "count": 6, "type": "VEC3",
                "min": part.min(0).tolist(), "max": part.max(0).tolist(),
            }
            for n, part in enumerate(corners)
        ],
        "bufferViews": [{"buffer": 0, "byteOffset": 72 * n, "byteLength": 72} for n in range(2)],
        "buffers": [{"byteLength": len(data)}],
    }  # fmt: skip
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def red(picture: Pixels) -> tuple[float, float]:
    """Middle of what is red, in parts of the picture's width and height."""
    levels = picture.astype(int)
    y, x = np.nonzero(levels[..., 0] > levels[..., 2] + 100)
    assert len(x) > 20
    return float(x.mean()) / picture.shape[1], float(y.mean()) / picture.shape[0]


def drop(page: Page, path: Path) -> None:
    """Drop a file or folder as from a desktop."""
    devtools = page.context.new_cdp_session(page)
    data = {"items": [], "files": [str(path)], "dragOperationsMask": 1}
    for kind in ("dragEnter", "dragOver", "drop"):
        event = {"type": kind, "x": 300, "y": 300, "data": data}
        devtools.send("Input.dispatchDragEvent", event)
        expect(page.locator("body.dropping")).to_have_count(int(kind != "drop"))


def drag(page: Page, dx: float, dy: float, *, shift: bool = False) -> None:
    box = page.locator("#stage").bounding_box()
    assert box
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    if shift:
        page.keyboard.down("Shift")
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + dx, y + dy, steps=5)
    page.mouse.up()
    page.keyboard.up("Shift")
    rest(page)


def test_the_first_picture_is_the_virtual_panels(visit: Open, client: httpx.Client) -> None:
    page = visit()
    assert np.array_equal(shown(page), seen(client, page))
    expect(page.locator("#timings")).to_contain_text("frame")
    expect(page.locator("#scene-facts")).to_contain_text("triangles")
    expect(page.locator("#device")).not_to_be_empty()


def test_a_dropped_model_is_orbited_and_seen_from_aside(
    visit: Open, client: httpx.Client, tmp_path: Path
) -> None:
    page = visit()
    (tmp_path / "squares.glb").write_bytes(two_squares())
    drop(page, tmp_path / "squares.glb")
    expect(page.locator("#scene option:checked")).to_have_text("squares.glb")
    rest(page)
    x, y = red(shown(page))
    assert (x, y) == pytest.approx((0.5, 0.5), abs=0.02)
    drag(page, 60, 40)  # what is in front follows the hand
    assert float(placed(page)["yaw"]) == pytest.approx(-24)
    assert np.array_equal(shown(page), seen(client, page))
    there = red(shown(page))
    assert min(there[0] - x, there[1] - y) > 0.02
    page.locator("#reset").click()
    rest(page)
    drag(page, 200, 0, shift=True)  # what is in front goes the other way
    expect(page.locator("#said")).to_contain_text("to the right")
    right = red(shown(page))[0]
    drag(page, -400, 0, shift=True)
    expect(page.locator("#said")).to_contain_text("to the left")
    assert right + 0.005 < x < red(shown(page))[0] - 0.005
    assert "yaw" not in placed(page)


def test_a_dropped_folder_asks_which_file_is_the_scene(visit: Open, tmp_path: Path) -> None:
    page = visit()
    parts = tmp_path / "model" / "parts"
    parts.mkdir(parents=True)
    shape = "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nusemtl red\nf 1 2 3\n"
    (tmp_path / "model" / "one.obj").write_text("mtllib parts/one.mtl\n" + shape)
    (tmp_path / "model" / "other.obj").write_text(shape)
    (parts / "one.mtl").write_text("newmtl red\nKd 1 0 0\n")
    drop(page, tmp_path / "model")
    page.get_by_role("dialog").get_by_role("combobox").select_option("model/one.obj")
    page.get_by_role("button", name="Take it").click()
    expect(page.locator("#scene option:checked")).to_have_text("one.obj")
    rest(page)
    red(shown(page))  # the material lies in the folder's folder
    page.locator("#scene-delete").click()
    expect(page.locator("#scene option", has_text="one.obj")).to_have_count(0)


def test_keys_do_what_the_mouse_does(visit: Open, client: httpx.Client) -> None:
    page = visit()
    page.locator("#stage").focus()
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("ArrowDown")
    rest(page)
    assert (placed(page)["yaw"], placed(page)["pitch"]) == ("5", "5")
    assert np.array_equal(shown(page), seen(client, page))
    page.keyboard.press("Home")
    rest(page)
    assert "yaw" not in placed(page)


def test_pairs_and_sweeps(visit: Open, client: httpx.Client) -> None:
    page = visit()
    page.get_by_text("Two", exact=True).click()
    rest(page)
    pair = seen(client, page, stereo=True)
    half = shown(page).shape[1] // 2
    assert np.array_equal(shown(page)[:, :half], pair[:, :half])
    assert np.array_equal(shown(page)[:, half:], pair[:, -half:])
    page.locator("#pair").select_option("crossed")
    rest(page)
    assert np.array_equal(shown(page)[:, half:], pair[:, :half])
    page.locator("#pair").select_option("anaglyph")
    rest(page)
    assert np.array_equal(shown(page)[..., 0], pair[:, :half, 0])
    assert np.array_equal(shown(page)[..., 1:], pair[:, -half:, 1:])
    page.get_by_text("Sweep", exact=True).click()
    rest(page)
    moving = shown(page)
    page.wait_for_timeout(300)
    assert not np.array_equal(shown(page), moving)
    page.locator("#play").click()
    still = shown(page)
    page.wait_for_timeout(300)
    assert np.array_equal(shown(page), still)


def test_displays_are_changed_edited_kept_and_deleted(
    visit: Open, client: httpx.Client, profile: dict[str, Any]
) -> None:
    page = visit()
    page.get_by_text("Edit the profile").click()
    page.locator("[name='viewing.views']").fill("5")
    page.locator("[name='panel.size_mm.1']").fill("96")
    page.wait_for_timeout(650)
    rest(page)
    profile = json.loads(json.dumps(profile))
    profile["viewing"]["views"], profile["panel"]["size_mm"] = 5, [96, 96]
    body = {"picture": "look", "scene": SCENE, "display": profile, "eye": "0,0,400"}
    assert np.array_equal(shown(page), pixels(client.post("/v1/render", json=body).content))
    page.locator("#display-name").fill("square")
    page.locator("#display-keep").click()
    expect(page.locator("#display")).to_have_value("square")
    assert client.get("/v1/displays/square").json()["viewing"]["views"] == 5
    page.locator("#display").select_option("small")
    rest(page)
    assert np.array_equal(shown(page), seen(client, page))
    page.locator("#display").select_option("square")
    page.locator("#display-delete").click()
    expect(page.locator("#display option", has_text="square")).to_have_count(0)
    assert client.get("/v1/displays/square").status_code == 404


def test_a_vendors_file_is_imported(visit: Open, client: httpx.Client, tmp_path: Path) -> None:
    page = visit()
    for kind, name in (("looking-glass", "visual.json"), ("3d-global", "panel.ini")):
        body = {"display": "small", "to": kind}
        file = tmp_path / name
        file.write_text(client.post("/v1/convert-display", json=body).json()["text"])
        with page.expect_response("**/v1/render"):
            page.locator("#profile-file").set_input_files(file)
        expect(page.locator("#display-facts")).to_contain_text("192 × 108 px")
        rest(page)
        expect(page.locator("#problem")).to_be_hidden()
    expect(page.locator("#display")).to_have_value("panel")


def test_downloads_are_the_apis_bytes(visit: Open, client: httpx.Client) -> None:
    page = visit()
    page.locator("#stage").focus()
    page.keyboard.press("ArrowRight")
    rest(page)
    line = page.locator("#shell").text_content() or ""
    address = line.removeprefix("curl -o eia.png ").strip("'")
    assert client.get(address).content == picture(client, "eia", **placed(page))
    for button, kind in (("Panel image", "eia"), ("Quilt", "quilt"), ("Views", "views")):
        with page.expect_download() as told:
            page.get_by_role("button", name=button, exact=True).click()
        assert told.value.suggested_filename.startswith(f"spheres-small-{kind}.")
        found = picture(client, kind, **placed(page))
        assert told.value.path().read_bytes() == found
    with page.expect_download() as told:
        page.get_by_role("button", name="Profile", exact=True).click()
    assert told.value.path().read_text() == client.get("/v1/displays/small").text


@pytest.mark.parametrize("ratio", [1, 1.5])
def test_full_screen_is_pixel_for_pixel(
    client: httpx.Client, server: Server, launch: Launch, profile: dict[str, Any], ratio: float
) -> None:
    # A browser of its own, since an emulated ratio leaves out what tells device pixels.
    with launch(f"--force-device-scale-factor={ratio}", "--window-size=500,300") as browser:
        page = browser.new_context(no_viewport=True).new_page()
        page.goto(server.url)
        size = page.evaluate(
            "[innerWidth, innerHeight].map((n) => Math.round(n * devicePixelRatio))"
        )
        profile = profile | {"panel": profile["panel"] | {"resolution_px": size}}
        client.put("/v1/displays/screen", json=profile).raise_for_status()
        page.goto(f"{server.url}/?display=screen&scene={SCENE.replace('?', '%3F')}")
        rest(page)
        page.locator("#stage").focus()
        page.keyboard.press("f")
        verdict = page.locator("#full p")
        expect(verdict).to_contain_text(f"Exact: {size[0]} × {size[1]} image pixels")
        expect(verdict).to_contain_text(f"ratio {ratio:g}")
        page.keyboard.press("h")
        expect(verdict).to_be_hidden()
        expected = pixels(picture(client, "eia", display="screen"))
        assert np.array_equal(shown(page, "#full canvas"), expected)
        assert np.array_equal(pixels(page.screenshot()), expected)
        page.locator("#full canvas").evaluate("canvas => canvas.style.scale = 1.001")  # a fault
        assert not np.array_equal(pixels(page.screenshot()), expected)
        page.keyboard.press("ArrowLeft")
        expect(verdict).to_be_visible()  # says so again, once the next image is there
        turned = pixels(picture(client, "eia", display="screen", yaw=5))
        assert np.array_equal(shown(page, "#full canvas"), turned)
        assert not np.array_equal(turned, expected)
        page.keyboard.press("Escape")
        expect(page.locator("#full")).to_be_hidden()


def test_a_screen_of_another_size_is_told(visit: Open) -> None:
    page = visit(viewport=(400, 300))
    page.locator("#enter").click()
    expect(page.locator("#full p")).to_contain_text(
        "Not exact: the panel has 192 × 108 pixels, this screen has 400 × 300"
    )


def test_the_panels_own_window_follows(visit: Open, client: httpx.Client) -> None:
    page = visit()
    with page.expect_popup() as told:
        page.locator("#window").click()
    panel = told.value
    panel.set_viewport_size({"width": 192, "height": 108})
    expect(panel.locator("p")).to_contain_text("image pixels", timeout=PATIENCE_MS)
    assert np.array_equal(shown(panel, "canvas"), pixels(picture(client, "eia")))
    page.locator("#stage").focus()
    page.keyboard.press("ArrowLeft")
    rest(page)
    turned = pixels(picture(client, "eia", yaw=5))
    panel.wait_for_timeout(400)
    assert np.array_equal(shown(panel, "canvas"), turned)


def test_mistakes_are_shown_with_their_field(visit: Open, tmp_path: Path) -> None:
    page = visit()
    page.get_by_text("Edit the profile").click()
    field = page.locator("[name='lens.lens_count']")
    field.fill("-3")
    problem = page.get_by_role("alert")
    expect(problem).to_contain_text("lens.lens_count is -3; it should be")
    expect(field).to_have_attribute("aria-invalid", "true")
    field.fill("24.3")
    expect(problem).to_be_hidden()
    expect(field).not_to_have_attribute("aria-invalid", "true")
    (tmp_path / "broken.glb").write_bytes(b"glTF, or not")
    drop(page, tmp_path / "broken.glb")
    expect(problem).to_contain_text("broken.glb")


def test_the_newest_request_wins(visit: Open, client: httpx.Client) -> None:
    page = visit()
    bodies: list[dict[str, Any]] = []
    ended: list[str] = []

    def hold(route: Route) -> None:
        bodies.append(json.loads(route.request.post_data or ""))
        if bodies[-1]["depth_scale"] != 0.5:
            route.continue_()

    page.route("**/v1/render", hold)
    page.on("requestfailed", lambda request: ended.append(str(request.failure)))
    page.locator("[name=depth_scale]").fill("0.5")
    page.wait_for_timeout(600)
    expect(page.locator("#stage")).to_have_attribute("aria-busy", "true")
    page.locator("[name=depth_scale]").fill("0.8")
    rest(page)
    assert set(ended) == {"net::ERR_ABORTED"}
    assert (bodies[0]["depth_scale"], bodies[-1]["depth_scale"]) == (0.5, 0.8)
    assert np.array_equal(shown(page), seen(client, page, depth_scale=0.8))


def test_a_panel_is_calibrated_by_eye(
    visit: Open, client: httpx.Client, profile: dict[str, Any]
) -> None:
    page = visit("calibrate?display=small", viewport=(1200, 900))
    page.locator("#exact-lens_count").fill("24.8")
    rest(page)
    page.locator("#range-tilt_deg").focus()
    page.keyboard.press("ArrowRight")
    rest(page)
    tilt = float(page.locator("#exact-tilt_deg").input_value())
    start = DisplayProfile.from_json(json.dumps(profile))
    known = adjusted(adjusted(start, "lens_count", 24.8), "tilt_deg", tilt)
    assert float(page.locator("#exact-center").input_value()) == pytest.approx(known.center)
    page.locator("#through").select_option("small")
    rest(page)
    fringes = shown(page, "#seen")
    page.locator("#enter").click()
    expect(page.locator("#full p")).to_contain_text("Not exact")
    page.keyboard.press("1")
    page.keyboard.press("Shift+ArrowLeft")
    expect(page.locator("#full p")).to_contain_text("Lens count 24.7000")
    now = adjusted(known, "lens_count", 24.7)
    page.wait_for_timeout(300)
    full = shown(page, "#full canvas")[: PANEL[1], : PANEL[0]]
    assert np.array_equal(full, view_grating(now, None, 1))
    page.keyboard.press("Escape")
    assert not np.array_equal(shown(page, "#seen"), fringes)
    page.locator("#unit-name").fill("my-unit")
    page.locator("#keep").click()
    expect(page.locator("#display")).to_have_value("my-unit")
    kept = DisplayProfile.from_json(client.get("/v1/displays/my-unit").text)
    assert kept.lens == now.lens
    assert not kept.template


def test_a_key_is_asked_for_once(visit: Open, start: Start) -> None:
    with start(api_keys="sesame") as server:
        page = visit("?scene=builtin:chart", url=server.url, wait=False)
        for key, said in (("wrong", "asks for an API key"), ("sesame", "not one of the server's")):
            expect(page.get_by_role("dialog")).to_contain_text(said)
            page.get_by_role("textbox", name="Key").fill(key)
            page.get_by_role("button", name="Use it").click()
        expect(page.locator("#display")).not_to_be_empty()
        page.reload()
        expect(page.locator("#display")).not_to_be_empty()
        expect(page.get_by_role("dialog")).to_have_count(0)


def test_it_fits_a_phone(visit: Open) -> None:
    for path in (
        "?display=small&scene=builtin:spheres%3Ftriangles=10000",
        "calibrate?display=small",
    ):
        page = visit(path, viewport=(360, 740), ratio=2)
        assert page.evaluate("document.documentElement.scrollWidth") <= 360

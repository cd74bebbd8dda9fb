"""The page's files, and the requests that calibration by eye makes."""

import io
import json
import re
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from PIL import Image

from lfd_render import DisplayProfile
from lfd_render.display.calibration.by_eye import adjusted
from lfd_render.display.patterns import PATTERNS, view_grating
from lfd_render.panel.look import look_from

from .conftest import Start

pytestmark = pytest.mark.needs("gl")

WEB = Path(__file__).resolve().parents[2] / "service" / "web"
PAGES = {"/": "index.html", "/calibrate": "calibrate.html", "/panel": "panel.html"}
LINK = re.compile(r'(?:src|href)="(page/[^"]+)"|from "\./([^"]+)"')
# What the page's Content-Security-Policy keeps from running, and what would need another host.
INLINE = re.compile(r"<script(?![^>]*\ssrc=)|\son\w+=|style=|javascript:|(?:src|href)=\"\w+://")


@pytest.fixture
def display(profile: dict[str, Any]) -> DisplayProfile:
    return DisplayProfile.from_json(json.dumps(profile))


def pixels(response: httpx.Response) -> np.ndarray[Any, np.dtype[np.uint8]]:
    assert response.status_code == 200, response.text
    return np.array(Image.open(io.BytesIO(response.content)).convert("RGB"))


@pytest.mark.parametrize(("path", "file"), PAGES.items())
def test_pages_are_whole_and_need_nothing_from_elsewhere(
    client: httpx.Client, path: str, file: str
) -> None:
    page = client.get(path)
    assert page.content == (WEB / file).read_bytes()
    assert "default-src 'none'; script-src 'self'" in page.headers["content-security-policy"]
    assert not INLINE.search(page.text)
    wanted, seen = [page.text], set()
    while wanted:
        for found in LINK.findall(wanted.pop()):
            name = found[0] or f"page/{found[1]}"
            if name not in seen:
                seen.add(name)
                part = client.get(f"/{name}")
                assert part.status_code == 200, name
                assert part.headers["x-content-type-options"] == "nosniff"
                wanted.append(part.text)
    assert {"page/style.css", "page/icon.svg", "page/exact.js"} <= seen


@pytest.mark.parametrize(
    "planted",
    ["<script>1</script>", '<p onclick="x()">', '<p style="color: red">', '<a href="https://x.y">'],
)
def test_what_is_inline_or_elsewhere_would_be_found(planted: str) -> None:
    assert INLINE.search(planted)


def test_pages_are_conditional_and_open(client: httpx.Client, start: Start) -> None:
    first = client.get("/")
    known = {"If-None-Match": f'"other", {first.headers["etag"]}'}
    assert client.get("/", headers=known).status_code == 304
    assert client.get("/page/none.js").status_code == 404
    assert client.get("/page/..%2Fapp.py").status_code == 404
    with start(api_keys="sesame") as server, server.client() as stranger:
        assert stranger.get("/").status_code == stranger.get("/page/view.js").status_code == 200
        assert stranger.get("/v1/displays").status_code == 401


@pytest.mark.parametrize("kind", PATTERNS)
def test_patterns_are_the_librarys(
    client: httpx.Client, small: str, display: DisplayProfile, kind: str
) -> None:
    found = client.get(f"/v1/displays/{small}/pattern", params={"kind": kind})
    assert np.array_equal(pixels(found), PATTERNS[kind](display))
    assert "map;dur=" in found.headers["server-timing"]


def test_a_pattern_through_another_panel_shows_its_fringes(
    client: httpx.Client, profile: dict[str, Any], display: DisplayProfile
) -> None:
    guess = adjusted(display, "lens_count", 26.3)
    body = {"display": json.loads(guess.to_json()), "width": 2, "colour": "green"}
    panel = view_grating(guess, None, 2, (1,))
    assert np.array_equal(pixels(client.post("/v1/pattern", json=body)), panel)
    seen = pixels(client.post("/v1/pattern", json=body | {"through": profile}))
    assert np.array_equal(seen, look_from(panel, display, (0.0, 0.0, 400.0)))
    right = pixels(client.post("/v1/pattern", json=body | {"display": profile, "through": profile}))
    middle = right.shape[0] // 2
    assert right[middle, 5:-5, 1].min() > 200  # evenly lit, where two lenses' fringes stood
    assert seen[middle, 5:-5, 1].min() < 50


def test_adjusting_is_what_the_guide_does(
    client: httpx.Client, small: str, display: DisplayProfile
) -> None:
    body = {"display": small, "lens_count": 24.9, "tilt_deg": -5.5, "name": "my-unit"}
    found = client.post("/v1/adjust-display", json=body)
    expected = adjusted(adjusted(display, "lens_count", 24.9), "tilt_deg", -5.5)
    made = DisplayProfile.from_json(found.text)
    assert made.lens == expected.lens
    assert (made.name, made.template) == ("my-unit", False)


@pytest.mark.parametrize(
    ("path", "body", "status", "field"),
    [
        ("pattern", {"kind": "stripes"}, 422, "kind"),
        ("pattern", {"kind": "white", "width": 3}, 400, "width"),
        ("pattern", {"view": 8}, 400, "view"),
        ("pattern", {"width": 9}, 400, "width"),
        ("pattern", {"size": "9x9"}, 400, "size"),
        ("pattern", {"eye": "0,0,400"}, 400, "eye"),
        ("pattern", {"through": "gavane-2024-tilted-4k"}, 400, "through"),
        ("pattern", {"through": "nobodys"}, 404, "display"),
        ("adjust-display", {"lens_count": 0.5}, 422, "lens_count"),
        ("adjust-display", {"tilt_deg": 89}, 422, "tilt_deg"),
        ("adjust-display", {"center": "middle"}, 422, "center"),
        ("adjust-display", {"name": "My Unit"}, 422, "name"),
    ],
)
def test_mistakes_are_named(
    client: httpx.Client, small: str, path: str, body: dict[str, Any], status: int, field: str
) -> None:
    found = client.post(f"/v1/{path}", json={"display": small} | body)
    assert (found.status_code, found.json()["field"]) == (status, field), found.text
    assert found.headers["content-type"] == "application/problem+json"

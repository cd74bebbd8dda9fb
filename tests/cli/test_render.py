"""`lfd-render render`, with a renderer that renders nothing: options in, picture and JSON out."""

import io
import json
import math
import sys
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from numpy.typing import NDArray

from lfd_render.display import Camera
from lfd_render.engine.texts import parse_exposure
from lfd_render.panel.picture import read_picture

from .conftest import PANEL, Command, FakeRenderer

pytestmark = pytest.mark.usefixtures("renderer")


def test_options_reach_the_renderer(
    command: Command, renderer: FakeRenderer, scene: Path, display: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out.png"
    result = command(
        "render", scene, "-o", out, "--display", display, "--views", 5, "--view-size", "30x20",
        "--technique", "mvr", "--mvr", "loop-4", "--preset", "paper", "--yaw", 90,
        "--depth-scale", 0.5, "--seed", 9, "--repeat", 3, "--device", "software",
        "--spacing", "angle", "--lod", "long-axis",
    )  # fmt: skip
    assert result.code == 0
    assert result.stdout == ""
    assert read_picture(out).shape == (PANEL[1], PANEL[0], 3)
    call = renderer.calls[0]
    camera = call.pop("camera")
    assert camera.yaw_rad == pytest.approx(math.pi / 2)
    assert camera.depth_scale == pytest.approx(0.5)
    assert call.pop("scene").triangle_count == 1
    assert call.pop("display").name == "small"
    assert renderer.device == "software"
    assert call.pop("progress") is None  # not long enough for a bar
    assert call == {
        "views": 5,
        "view_size": (30, 20),
        "technique": "mvr",
        "mvr": "loop-4",
        "preset": "paper",
        "lookup": "lens",
        "weave": "nearest",
        "aa": None,
        "aa_light": "linear",
        "supersample": (1, 1),
        "linear": False,
        "splat": "auto",
        "spacing": "angle",
        "lod": "long-axis",
        "lattice": None,
        "point_source": None,
        "density": None,
        "texture_limit": None,
        "culling": None,
        "stochastic_culling": None,
        "shade": None,
        "effort": False,
        "seed": 9,
        "repeat": 3,
        "environment": "studio",
        "environment_turn_rad": 0.0,
        "environment_intensity": 1.0,
        "exposure": 1.0,
    }


def test_the_ideas_of_lfdpr_reach_the_renderer(
    command: Command, renderer: FakeRenderer, scene: Path, display: Path, tmp_path: Path
) -> None:
    result = command(
        "render", scene, "-o", tmp_path / "a.png", "-d", display, "--json", "--lattice", "paper",
        "--point-source", "raster", "--density", "isotropic", "--no-texture-limit",
        "--culling", "vertices", "--stochastic-culling", "--shade", "point",
    )  # fmt: skip
    assert result.code == 0
    given = {
        "lattice": "paper",
        "point_source": "raster",
        "density": "isotropic",
        "texture_limit": False,
        "culling": "vertices",
        "stochastic_culling": True,
        "shade": "point",
        "effort": True,  # counted for --json
    }
    assert given.items() <= renderer.calls[0].items()


def test_light_reaches_the_renderer(
    command: Command, renderer: FakeRenderer, scene: Path, display: Path, tmp_path: Path
) -> None:
    sky = tmp_path / "sky.exr"
    write_panorama(sky, np.full((2, 4, 3), 0.5, np.float32))
    arguments = ("render", scene, "-o", tmp_path / "a.png", "-d", display)
    result = command(
        *arguments, "--environment", sky, "--environment-turn", 90,
        "--environment-intensity", 0.25, "--exposure", "-1.5EV",
    )  # fmt: skip
    assert result.code == 0
    call = renderer.calls[0]
    assert call["environment"].name == str(sky)
    assert call["environment_turn_rad"] == pytest.approx(math.pi / 2)
    assert call["environment_intensity"] == pytest.approx(0.25)
    assert call["exposure"] == pytest.approx(2**-1.5)
    assert command(*arguments, "--environment", "none").code == 0
    assert renderer.calls[1]["environment"] == "none"


@pytest.mark.parametrize(
    ("text", "factor"),
    [("1", 1), ("0.25", 0.25), (".5", 0.5), ("1e-3", 1e-3), ("+1.5EV", 2**1.5), ("-9ev", 2**-9),
     ("0EV", 1)],
)  # fmt: skip
def test_exposure_is_a_factor_or_stops(text: str, factor: float) -> None:
    assert parse_exposure(text) == pytest.approx(factor)


@pytest.mark.parametrize(
    "text", ["0", "-1", "nan", "inf", "1e99", "61EV", "EV", "1 2", "", "1E", "९"]
)
def test_exposures_that_make_no_picture(
    command: Command, scene: Path, text: str, tmp_path: Path
) -> None:
    result = command("render", scene, "-o", tmp_path / "a.png", "--exposure", text)
    assert result.code == 2
    assert result.error.startswith(f"--exposure: '{text}'; give a factor above 0")


@pytest.mark.parametrize(
    ("options", "code", "expected"),
    [
        (["--environment", "no such.exr"], 7, "no such.exr: no such file; give an EXR, HDR"),
        (["--environment-turn", "nan"], 2, "--environment-turn: nan; give a finite number"),
        (["--environment-intensity", "-1"], 2, "--environment-intensity: -1.0; give a number"),
    ],
)
def test_bad_environments(
    command: Command, scene: Path, options: list[str], code: int, expected: str, tmp_path: Path
) -> None:
    result = command("render", scene, "-o", tmp_path / "a.png", *options)
    assert result.code == code
    assert result.error.startswith(expected)


def test_bright_lights_get_a_hint_unless_there_is_an_exposure(
    command: Command, scene: Path, display: Path, tmp_path: Path
) -> None:
    document = json.loads(scene.read_text(encoding="utf-8"))
    lamp = {"type": "point", "intensity": 54351}
    document["extensions"] = {"KHR_lights_punctual": {"lights": [lamp]}}
    document["nodes"][1]["extensions"] = {"KHR_lights_punctual": {"light": 0}}
    lit = tmp_path / "lit.gltf"
    lit.write_text(json.dumps(document), encoding="utf-8")
    arguments = ("render", lit, "-o", tmp_path / "a.png", "-d", display)
    # 54351 cd from 5 away on a white wall: 54351/25/π is 692, 9.4 stops.
    assert "white about 692 times as bright" in command(*arguments).stderr
    assert "try --exposure -9.5EV" in command(*arguments).stderr
    assert "--exposure" not in command(*arguments, "--exposure", "1").stderr


def write_panorama(path: Path, pixels: NDArray[np.float32]) -> None:
    out = oiio.ImageOutput.create(str(path))
    assert out.open(str(path), oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, "float"))
    assert out.write_image(pixels)
    out.close()


def test_json_is_one_object_and_messages_go_to_stderr(
    command: Command, scene: Path, display: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out.png"
    result = command("render", scene, "-o", out, "-d", display, "--json")
    assert "something odd" in result.stderr
    found = result.json
    assert found["output"] == str(out)
    assert found["display"] == "small"
    expected = {
        "technique",
        "views",
        "view_size",
        "triangles",
        "points",
        "renderer",
        "device_bytes",
    }
    assert expected <= set(found)
    assert list(found["timings_ms"]) == [
        "load", "compile", "splat", "frame", "read", "encode", "total"
    ]  # fmt: skip
    assert found["timings_ms"]["total"] > found["timings_ms"]["load"] > 0


def test_camera_of_json_is_a_camera_file(
    command: Command, renderer: FakeRenderer, scene: Path, display: Path, tmp_path: Path
) -> None:
    arguments = ("render", scene, "-o", tmp_path / "a.png", "-d", display, "--json")
    first = command(*arguments, "--yaw", 20, "--depth-scale", 0.7).json["camera"]
    file = tmp_path / "camera.json"
    file.write_text(json.dumps(first), encoding="utf-8")
    assert command(*arguments, "--camera", file).code == 0
    asked = [call["camera"].display_from_world(call["display"].size_mm) for call in renderer.calls]
    np.testing.assert_allclose(asked[0], asked[1], rtol=0, atol=1e-9)


@pytest.mark.parametrize(("extra", "distance"), [((), 5.0), (("--focus-distance", "2"), 2.0)])
def test_camera_of_the_scene(
    command: Command,
    renderer: FakeRenderer,
    scene: Path,
    display: Path,
    tmp_path: Path,
    extra: tuple[str, ...],
    distance: float,
) -> None:
    out = tmp_path / "a.png"
    assert command("render", scene, "-o", out, "-d", display, "--camera", "front", *extra).code == 0
    camera: Camera = renderer.calls[0]["camera"]
    assert camera.target == pytest.approx((0, 0, 4 - distance))
    assert camera.eye_direction == pytest.approx((0, 0, 1))
    assert camera.window_height == pytest.approx(2 * distance * math.tan(math.radians(22.5)))


def test_unknown_camera_lists_the_scene_s(
    command: Command, renderer: FakeRenderer, scene: Path, tmp_path: Path
) -> None:
    result = command("render", scene, "-o", tmp_path / "a.png", "--camera", "back")
    assert result.code == 3
    assert "'back'" in result.error
    assert "'front'" in result.error
    assert renderer.calls == []


def test_focus_distance_needs_a_camera_of_the_scene(
    command: Command, scene: Path, tmp_path: Path
) -> None:
    result = command("render", scene, "-o", tmp_path / "a.png", "--focus-distance", 3)
    assert result.code == 2
    assert "camera NAME" in result.error


def test_dash_writes_the_picture_to_stdout(
    command: Command, scene: Path, display: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stdout = io.TextIOWrapper(io.BytesIO())
    monkeypatch.setattr(sys, "stdout", stdout)
    assert command("render", scene, "-o", "-", "-d", display).code == 0
    stdout.seek(0)
    (tmp_path / "a.png").write_bytes(stdout.buffer.read())
    assert read_picture(tmp_path / "a.png").shape == (PANEL[1], PANEL[0], 3)


@pytest.mark.parametrize(
    ("output", "options", "kind"),
    [
        ("out.exr", (), "exr"),
        ("out.raw", (), "raw"),
        ("out", ("--format", "png"), "png"),
        ("out.png", ("--format", "exr"), "exr"),
        ("-", ("--format", "raw"), "raw"),
        ("-", ("--format", "exr"), "exr"),
    ],
)
def test_formats_by_name_or_as_asked(
    command: Command,
    scene: Path,
    display: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    output: str,
    options: tuple[str, ...],
    kind: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    stdout = io.TextIOWrapper(io.BytesIO())
    if output == "-":
        monkeypatch.setattr(sys, "stdout", stdout)
    assert command("render", scene, "-o", output, "-d", display, *options).code == 0
    stdout.seek(0)
    data = stdout.buffer.read() if output == "-" else (tmp_path / output).read_bytes()
    starts = {"exr": b"\x76\x2f\x31\x01", "png": b"\x89PNG", "raw": b"\x7f" * 4}
    assert data.startswith(starts[kind])
    if kind == "raw":
        assert len(data) == PANEL[0] * PANEL[1] * 3
    names = {path.name for path in tmp_path.iterdir()}
    expected = set() if output == "-" else {output} | ({"out.raw.json"} if kind == "raw" else set())
    assert names == expected


@pytest.mark.parametrize(
    ("output", "code", "words"),
    [
        ("missing/out.png", 8, "no such folder"),
        ("/dev/null", 8, "is a device"),
        (".", 8, "is a folder"),
        ("/proc/out.png", 8, "/proc"),
        ("out.jpg", 2, ".png"),
        ("out", 2, ".png"),
    ],
)
def test_bad_output_ends_before_rendering(
    command: Command,
    renderer: FakeRenderer,
    scene: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    output: str,
    code: int,
    words: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    result = command("render", scene, "-o", output)
    assert result.code == code
    assert words in result.error
    assert renderer.calls == []
    assert list(tmp_path.iterdir()) == []


def test_stdout_carries_one_thing(command: Command, scene: Path) -> None:
    result = command("render", scene, "-o", "-", "--json")
    assert result.code == 2
    assert "--json" in result.error


def test_panel_options_reach_the_renderer(
    command: Command, renderer: FakeRenderer, scene: Path, display: Path, tmp_path: Path
) -> None:
    result = command(
        "render", scene, "-o", tmp_path / "out.png", "--display", display, "--views", "continuous",
        "--lookup", "subpixel", "--aa", "both", "--aa-light", "encoded", "--supersample", "3x1",
        "--preset", "gold",
    )  # fmt: skip
    assert result.code == 0
    call = renderer.calls[0]
    assert callable(call["progress"])
    wanted = {
        "views": "continuous", "lookup": "subpixel", "aa": "both", "aa_light": "encoded",
        "supersample": (3, 1), "preset": "gold",
    }  # fmt: skip
    assert {name: call[name] for name in wanted} == wanted


@pytest.mark.parametrize(
    ("option", "value"),
    [("--supersample", "2by3"), ("--supersample", "0x2"), ("--views", "0"), ("--views", "some")],
)
def test_bad_panel_options_are_named(
    command: Command, scene: Path, display: Path, tmp_path: Path, option: str, value: str
) -> None:
    result = command("render", scene, "-o", tmp_path / "a.png", "-d", display, option, value)
    assert result.code == 2
    assert f"{option}: '{value}'" in result.error

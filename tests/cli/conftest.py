"""The command line run in this process, with a renderer that renders nothing, and small inputs."""

import base64
import json
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import lfd_render.renderer
from lfd_render.cli.main import main
from lfd_render.display import Camera, DisplayProfile
from lfd_render.panel.eia import Eia
from lfd_render.panel.quilt import Quilt
from lfd_render.panel.unweave import Unwoven
from lfd_render.scene import Scene

PANEL = (192, 108)
VIEWS = 8


@dataclass
class Result:
    """What a command left behind."""

    code: int
    stdout: str
    stderr: str

    @property
    def json(self) -> dict[str, Any]:
        """The one JSON object on stdout."""
        assert self.stdout.count("\n") == 1
        found: dict[str, Any] = json.loads(self.stdout)
        return found

    @property
    def error(self) -> str:
        """The one error line, which comes last."""
        lines = [line for line in self.stderr.splitlines() if "warning:" not in line]
        assert len(lines) == 1, lines
        assert lines[0].startswith("lfd-render: error: ")
        return lines[0].removeprefix("lfd-render: error: ")


Command = Callable[..., Result]


@pytest.fixture
def command(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Command:
    """``command("render", scene, …)`` runs the command line in this process."""

    def run(*arguments: object) -> Result:
        monkeypatch.setattr(sys, "argv", ["lfd-render", *map(str, arguments)])
        capsys.readouterr()
        code = main()
        return Result(code, *capsys.readouterr())

    return run


@dataclass
class FakeRenderer:
    """Records what it was asked for and gives a grey panel image, or raises `error`."""

    error: BaseException | None = None
    device: str = ""
    warnings: tuple[str, ...] = ("something odd",)
    calls: list[dict[str, Any]] = field(default_factory=list)

    def __call__(self, device: str) -> "FakeRenderer":
        self.device = device
        return self

    def __enter__(self) -> "FakeRenderer":
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def render(self, scene: Scene, display: DisplayProfile, camera: Camera, **options: Any) -> Eia:
        self._record(scene=scene, display=display, camera=camera, **options)
        width, height = display.resolution_px
        views = options.get("views") or display.views
        report = {
            "technique": options.get("technique", "lfdpr"),
            "views": views,
            "view_size": [24, 14],
            "triangles": scene.triangle_count,
            "points": 7,
            "renderer": "fake",
            "device_bytes": 1000,
            "warnings": ["something odd"],
            "camera": camera.to_json_dict(),
            "timings_ms": {"compile": 1.0, "splat": 2.0, "frame": 3.0, "read": 4.0},
        }
        pixels = np.full((height, width, 3), 127, np.uint8)
        metadata = {"lfd:profile": display.name, "lfd:profile-hash": display.hash}
        metadata["lfd:views"] = str(views)
        return Eia(pixels, pixels.astype(np.float16), report, metadata)

    def views(
        self, scene: Scene, display: DisplayProfile, camera: Camera, **options: Any
    ) -> np.ndarray[Any, np.dtype[np.uint8]]:
        self._record(scene=scene, display=display, camera=camera, **options)
        count = options["views"] or display.views
        shades = np.arange(count, dtype=np.uint8)[:, None, None, None]
        heights = options.get("heights_mm")
        lines = () if heights is None else (len(heights),)
        return np.broadcast_to(shades, (*lines, count, 14, 24, 3))

    def weave(self, views: Quilt | Unwoven, display: DisplayProfile, **choices: str) -> Eia:
        self._record(views=views, display=display, **choices)
        width, height = display.resolution_px
        pixels = np.full((height, width, 3), 127, np.uint8)
        report = {"views": len(views.views), "warnings": [], "timings_ms": {"weave": 1.0}}
        return Eia(pixels, pixels.astype(np.float16), report, {"lfd:profile": display.name})

    def _record(self, **call: Any) -> None:
        self.calls.append(call)
        if self.error is not None:
            raise self.error


@pytest.fixture
def renderer(monkeypatch: pytest.MonkeyPatch) -> FakeRenderer:
    """Stands in for the real renderer and tells what it was asked."""
    fake = FakeRenderer()
    module = ModuleType("lfd_render.renderer")
    module.__dict__.update(vars(lfd_render.renderer) | {"Renderer": fake})
    monkeypatch.setitem(sys.modules, "lfd_render.renderer", module)
    return fake


@pytest.fixture(scope="session")
def display(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Profile file of a small display, 192 × 108 pixels, 8 views, 30°."""
    profile = {
        "schema": "lfd-display/1",
        "name": "small",
        "panel": {
            "resolution_px": list(PANEL),
            "size_mm": [96.0, 54.0],
            "subpixels": {"layout": "stripe", "order": "rgb", "origin": "red-at-pixel-centre"},
        },
        "lens": {"lens_count": 24.3, "drift": -0.05, "center": 0.2, "index": 1.49},
        "viewing": {"views": VIEWS, "cone_deg": 30.0, "distance_mm": 400.0, "spacing": "lens"},
    }
    path = tmp_path_factory.mktemp("display") / "small.json"
    path.write_text(json.dumps(profile), encoding="utf-8")
    return path


@pytest.fixture(scope="session")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A glTF file: a triangle 2 wide at z = −1, and the camera 'front' at z = 4, 45° high."""
    positions = np.array([[-1, -1, -1], [1, -1, -1], [0, 1, -1]], "<f4")
    uri = "data:application/octet-stream;base64," + base64.b64encode(positions.tobytes()).decode()
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"mesh": 0}, {"camera": 0, "translation": [0, 0, 4]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "cameras": [
            {
                "name": "front",
                "type": "perspective",
                "perspective": {"yfov": float(np.radians(45)), "znear": 0.1},
            }
        ],
        "accessors": [
            {
                "bufferView": 0,
                "componentType": 5126,
                "count": 3,
                "type": "VEC3",
                "min": [-1, -1, -1],
                "max": [1, 1, -1],
            }
        ],
        "bufferViews": [{"buffer": 0, "byteLength": positions.nbytes}],
        "buffers": [{"uri": uri, "byteLength": positions.nbytes}],
    }
    path = tmp_path_factory.mktemp("scene") / "triangle.gltf"
    path.write_text(json.dumps(document), encoding="utf-8")
    return path

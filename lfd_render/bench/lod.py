"""How each rule for levels of detail compares with a supersampled picture: error and time.

    python -m lfd_render.bench.lod [--json] [--pictures FOLDER]

A corridor of fine textures, stretched, turned, and seen at grazing angles, is rendered into many
views by LFDPR and each rule, and compared with the standard (`bench.gold`) of SAMPLES × SAMPLES
samples a pixel.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import statistics
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfd_render.bench.gold import alone, chosen_views, gold_standard, write_views
from lfd_render.display import Camera, DisplayProfile
from lfd_render.errors import LfdError
from lfd_render.gpu.layout import LOD_RULES
from lfd_render.quality import rmse, ssim_luma
from lfd_render.renderer import Renderer
from lfd_render.scene import Image, Instance, Material, Scene, TextureSlot
from lfd_render.scene.procedural.grid import Surface, tessellate
from lfd_render.scene.procedural.lettering import lettering
from lfd_render.scene.procedural.shapes import plane
from lfd_render.scene.procedural.textures import to_pixels

Pixels = NDArray[np.uint8]
DISPLAY = "gavane-2024-tilted-4k"
_INK, _PAPER = 0.1, 0.88  # sRGB; paper is 0.75 in linear light, below the tone curve's shoulder


@dataclasses.dataclass(frozen=True)
class Study:
    """What is measured. compared: how many of the views, evenly chosen, extremes included."""

    views: int = 48
    view_size: tuple[int, int] = (480, 360)
    compared: int = 5
    samples: int = 8
    standard_lod: str = "anisotropic"
    frames: int = 3
    rounds: int = 3


@dataclasses.dataclass(frozen=True)
class Result:
    """A rule's mean RMSE (levels of 255) and SSIM over the compared views, and a frame's time."""

    rule: str
    rmse: float
    ssim: float
    frame_ms: float
    shade_ms: float


def corridor(width: float, height: float) -> Scene:
    """Floor, ceiling, walls and an end of fine black-and-white pictures behind a window of that
    size, four windows' heights deep, all unlit."""
    depth = 4.0 * height
    w, h = 0.5 * width, 0.5 * height
    tile = 0.5 * height  # side of a picture's first repeat on the floor
    surfaces = [
        Surface("floor", plane((-w, -h, -depth), (width, 0, 0), (0, 0, depth)), (1, 1), 0),
        Surface("ceiling", plane((-w, h, 0), (width, 0, 0), (0, 0, -depth)), (1, 1), 1),
        Surface("left", plane((-w, h, 0), (0, 0, -depth), (0, -height, 0)), (1, 1), 2),
        Surface("right", plane((w, h, -depth), (0, 0, depth), (0, -height, 0)), (1, 1), 3),
        Surface("end", plane((-w, h, -depth), (width, 0, 0), (0, -height, 0)), (1, 1), 4),
    ]
    images = [
        Image("checker", _checker(512, 512, 16)),
        Image("squares", _checker(64, 256, 4)),
        Image("lettering", _lettered(1024, 128)),
        Image("lines", _lines(128, 512)),
        Image("end", _lettered(256, 256)),
    ]
    # Repeats along u and v; each is a surface's length over a picture's.
    repeats = [
        (0.5 * width / tile, 0.5 * depth / tile),
        (width / tile, 2.0 * depth / tile),
        (0.5 * depth / tile, 2.0),
        (depth / tile, 2.0),
        (2.0 * width / tile, 4.0),
    ]
    turns = [0.0, 0.35, 0.0, 0.6, 0.0]
    materials = tuple(
        Material(
            image.name,
            unlit=True,
            base_color_texture=TextureSlot(index, uv_transform=_placed(*repeat, turn)),
        )
        for index, (image, repeat, turn) in enumerate(zip(images, repeats, turns, strict=True))
    )
    meshes = tessellate(surfaces, [1] * len(surfaces), 2 * len(surfaces))
    instances = tuple(Instance(mesh.name, i, np.eye(4)) for i, mesh in enumerate(meshes))
    return Scene("corridor", tuple(meshes), instances, materials, tuple(images))


def _placed(u: float, v: float, turn_rad: float) -> NDArray[np.float64]:
    """Texture transform [3, 3]: so many repeats, then turned."""
    cos, sin = np.cos(turn_rad), np.sin(turn_rad)
    matrix = np.eye(3)
    matrix[:2, :2] = np.array([[cos, sin], [-sin, cos]]) @ np.diag([u, v])
    return matrix


def _painted(ink: NDArray[np.bool_]) -> Pixels:
    grey = np.where(ink, _INK, _PAPER)
    return to_pixels((grey, grey, grey))


def _checker(width: int, height: int, square: int) -> Pixels:
    y, x = np.mgrid[:height, :width] // square
    return _painted((x + y) % 2 == 1)


def _lines(width: int, height: int) -> Pixels:
    """Thin upright lines, a heavy one every eighth, and a level one."""
    y, x = np.mgrid[:height, :width]
    return _painted((x % 8 < 2) | (x % 64 < 6) | (y % 64 < 6))


def _lettered(width: int, height: int) -> Pixels:
    """Lines of figures 14 texels high."""
    ink = np.zeros((height, width), bool)
    for line, top in enumerate(range(4, height - 14, 20)):
        text = "".join(str((7 * line + 3 * k) % 10) for k in range(width // 12))
        row = lettering(text, 2)[:, : width - 4]
        ink[top : top + row.shape[0], 2 : 2 + row.shape[1]] = row
    return _painted(ink)


def _camera(display: DisplayProfile) -> Camera:
    """The window in its own millimetres."""
    return Camera((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), display.size_mm[1])


def measure(
    renderer: Renderer, display: DisplayProfile, study: Study, pictures: Path | None = None
) -> list[Result]:
    """Every rule against the standard; pictures: a folder for the compared views, or None.

    Raises UsageError without scikit-image.
    """
    scene, camera = corridor(*display.size_mm), _camera(display)
    rig = display.rig(study.views)
    chosen = chosen_views(rig.views, study.compared)
    standard = [
        gold_standard(
            renderer, scene, display, camera, eye=alone(rig, view), view_size=study.view_size,
            samples=study.samples, lod=study.standard_lod,
        )
        for view in chosen
    ]  # fmt: skip
    found = {
        rule: renderer.views(
            scene, display, camera, rig=rig, view_size=study.view_size, lod=rule, shade="ray"
        )[chosen]
        for rule in LOD_RULES
    }
    if pictures is not None:
        write_views(pictures, chosen, {"standard": np.stack(standard), **found})
    times = _times(renderer, scene, display, study)
    results = []
    for rule in LOD_RULES:
        pairs = list(zip(found[rule], standard, strict=True))
        error = statistics.fmean(rmse(a, b) for a, b in pairs)
        likeness = statistics.fmean(ssim_luma(a, b) for a, b in pairs)
        results.append(Result(rule, error, likeness, *times[rule]))
    return results


def _times(
    renderer: Renderer, scene: Scene, display: DisplayProfile, study: Study
) -> dict[str, tuple[float, float]]:
    """Frame and shading milliseconds of each rule: the least of rounds' medians, for what else a
    machine does only adds. Rounds go through all rules in turn."""
    times: dict[str, list[tuple[float, float]]] = {rule: [] for rule in LOD_RULES}
    for _ in range(study.rounds):
        for rule in LOD_RULES:
            timings = renderer.render(
                scene,
                display,
                _camera(display),
                study.views,
                view_size=study.view_size,
                repeat=study.frames,
                lod=rule,
            ).report["timings_ms"]
            times[rule].append((timings["frame"], timings["shade"]))
    return {rule: min(rounds) for rule, rounds in times.items()}


def table(results: Sequence[Result]) -> str:
    """Results as a Markdown table; times over those of `none`."""
    least = results[0]
    lines = [
        "| Rule | RMSE | SSIM | frame, ms | frame | shade |",
        "|---|---|---|---|---|---|",
    ]
    lines += [
        f"| `{r.rule}` | {r.rmse:.2f} | {r.ssim:.4f} | {r.frame_ms:.0f} | "
        f"{r.frame_ms / least.frame_ms:.2f} × | {r.shade_ms / least.shade_ms:.2f} × |"
        for r in results
    ]
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """The command; returns its exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--device", default="auto")
    parser.add_argument("--views", type=int, default=Study.views)
    parser.add_argument("--compared", type=int, default=Study.compared)
    parser.add_argument("--samples", type=int, default=Study.samples)
    parser.add_argument("--standard-lod", default=Study.standard_lod)
    parser.add_argument("--frames", type=int, default=Study.frames)
    parser.add_argument("--rounds", type=int, default=Study.rounds)
    parser.add_argument("--pictures", type=Path, metavar="FOLDER")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    options: dict[str, Any] = vars(parser.parse_args(arguments))
    device, as_json, pictures = (options.pop(name) for name in ("device", "json", "pictures"))
    study = Study(**options)
    try:
        with Renderer(device) as renderer:
            results = measure(renderer, DisplayProfile.load(DISPLAY), study, pictures)
            device_name = renderer.device.name
    except LfdError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    if as_json:
        rows = [dataclasses.asdict(result) for result in results]
        print(json.dumps({"device": device_name, **dataclasses.asdict(study), "rules": rows}))
    else:
        print(f"{device_name}\n\n{table(results)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

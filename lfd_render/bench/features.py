"""What each idea of LFDPR gives: points, pairs, a frame's time and the picture's error, on and off.

    python -m lfd_render.bench.features SCENE[*COPIES] … [--json]

Every variant changes one choice of the default preset; `paper` changes all that the paper does
otherwise, `mvr` is plain multi-view rasterisation. Frames go through variants in turn, so that what
else a machine does falls on all of them. Errors are against the supersampled standard of
`lfd_render.bench.gold` at a few views' own eyes, over the box of what they show.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import statistics
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

from lfd_render.bench.gold import alone, chosen_views, gold_standard, likeness
from lfd_render.display import DisplayProfile
from lfd_render.errors import LfdError, UsageError
from lfd_render.renderer import Renderer, camera_for
from lfd_render.scene import Scene

DISPLAY = "gavane-2024-tilted-4k"
BASE = "default"
VARIANTS: dict[str, dict[str, Any]] = {
    BASE: {},
    "density isotropic": {"density": "isotropic"},
    "no texture limit": {"texture_limit": False},
    "stochastic culling": {"stochastic_culling": True},
    "culling by vertices": {"culling": "vertices"},
    "shade by rays": {"shade": "ray"},
    "shade at points": {"shade": "point"},
    "lattice paper": {"lattice": "paper"},
    "lattice paper, isotropic": {"lattice": "paper", "density": "isotropic"},
    "lattice paper, no limit": {"lattice": "paper", "texture_limit": False},
    "lattice paper, raster": {"lattice": "paper", "point_source": "raster"},
    "splat two-pass": {"splat": "two-pass"},
    "lod none": {"lod": "none"},
    "lod area": {"lod": "area"},
    "lod long-axis": {"lod": "long-axis"},
    "lod multiview": {"lod": "multiview"},
    "paper": {"preset": "paper"},
    "mvr": {"technique": "mvr"},
}


@dataclasses.dataclass(frozen=True)
class Study:
    """What is measured. compared: how many of the views, evenly chosen, extremes included."""

    views: int = 48
    view_size: tuple[int, int] = (480, 360)
    compared: int = 3
    samples: int = 8
    rounds: int = 3


@dataclasses.dataclass(frozen=True)
class Result:
    """One variant on one scene. points and pairs are None where there are none; ratio: a frame's
    median time over the base's; rmse in levels of 255, and ssim, means over compared views;
    visible: view pixels that show something, None for mvr."""

    variant: str
    points: int | None
    pairs_per_pixel: float | None
    visible: int | None
    ratio: float
    rmse: float
    ssim: float


def copies(scene: Scene, count: int) -> Scene:
    """A scene so many times over, side by side in as many columns as rows, each turned a little."""
    scene = scene.posed()  # so that no node says where an instance stands
    low, high = scene.bounds()
    spacing = 1.05 * float(np.hypot(*(high - low)[[0, 2]]))
    columns = int(np.ceil(np.sqrt(count)))
    middle = 0.5 * (low + high)
    instances = []
    for n in range(count):
        angle = 2.4 * n  # about +y, near the golden angle, so that no two look alike
        turn, there, back = np.eye(4), np.eye(4), np.eye(4)
        turn[0, 0] = turn[2, 2] = np.cos(angle)
        turn[0, 2], turn[2, 0] = np.sin(angle), -np.sin(angle)
        back[:3, 3] = -middle
        there[:3, 3] = middle + spacing * np.array([n % columns, 0.0, -(n // columns)])
        instances += [
            dataclasses.replace(
                instance, world_from_local=there @ turn @ back @ instance.world_from_local
            )
            for instance in scene.instances
        ]
    return dataclasses.replace(
        scene, name=f"{scene.name} × {count}", instances=tuple(instances), default_camera=None
    )


def load(text: str) -> Scene:
    """The scene of ``FILE`` or ``FILE*COPIES``. Raises UsageError or SceneError."""
    source, star, count = text.rpartition("*")
    if not star:
        return Scene.load(text)
    if not count.isdecimal() or not 1 <= int(count) <= 1000:
        raise UsageError(f"scene '{text}': copies '{count}'; use a whole number from 1 to 1000")
    return copies(Scene.load(source), int(count))


def measure(
    renderer: Renderer, scene: Scene, display: DisplayProfile, study: Study
) -> list[Result]:
    """All variants on one scene. Raises UsageError without scikit-image."""
    camera, rig = camera_for(scene, display), display.rig(study.views)
    chosen = chosen_views(study.views, study.compared)
    standard = [
        gold_standard(
            renderer,
            scene,
            display,
            camera,
            eye=alone(rig, view),
            view_size=study.view_size,
            samples=study.samples,
        )
        for view in chosen
    ]
    frames: dict[str, list[float]] = {name: [] for name in VARIANTS}
    reports: dict[str, dict[str, Any]] = {}
    for turn in range(study.rounds):
        for name, options in VARIANTS.items():
            count = {"effort": True} if turn == 0 and name != "mvr" else {}
            report = renderer.render(
                scene,
                display,
                camera,
                study.views,
                **{"view_size": study.view_size, "repeat": 2, **options, **count},
            ).report
            frames[name].append(report["timings_ms"]["frame"])
            reports.setdefault(name, report)
    base = statistics.median(frames[BASE])
    results = []
    for name, options in VARIANTS.items():
        pictures = renderer.views(
            scene, display, camera, rig=rig, **{"view_size": study.view_size, **options}
        )[chosen]
        pairs = [likeness(a, b) for a, b in zip(pictures, standard, strict=True)]
        report = reports[name]
        results.append(
            Result(
                variant=name,
                points=report["points"] or None,
                pairs_per_pixel=report.get("pairs_per_visible_pixel"),
                visible=report.get("visible_pixels"),
                ratio=statistics.median(frames[name]) / base,
                rmse=statistics.fmean(error for error, _ in pairs),
                ssim=statistics.fmean(alike for _, alike in pairs),
            )
        )
    return results


def table(results: Sequence[Result]) -> str:
    """Results as a Markdown table. Lost: visible pixels fewer than the base shows."""
    base = results[0].visible or 0
    lines = [
        "| Variant | points | pairs a pixel | lost pixels | frame | RMSE | SSIM |",
        "|---|---|---|---|---|---|---|",
    ]
    for r in results:
        points = "" if r.points is None else f"{r.points:,}"
        pairs = "" if r.pairs_per_pixel is None else f"{r.pairs_per_pixel:.2f}"
        lost = "" if r.visible is None else f"{base - r.visible:,}"
        lines.append(
            f"| {r.variant} | {points} | {pairs} | {lost} | {r.ratio:.2f} × | {r.rmse:.2f} | "
            f"{r.ssim:.4f} |"
        )
    return "\n".join(lines)


def _size(text: str) -> tuple[int, int]:
    width, height = (int(side) for side in text.split("x"))
    return width, height


def main(arguments: Sequence[str] | None = None) -> int:
    """The command; returns its exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("scenes", nargs="+", metavar="SCENE[*COPIES]")
    parser.add_argument("--device", default="auto")
    parser.add_argument("--views", type=int, default=Study.views)
    parser.add_argument("--view-size", type=_size, default=Study.view_size, metavar="WxH")
    parser.add_argument("--compared", type=int, default=Study.compared)
    parser.add_argument("--samples", type=int, default=Study.samples)
    parser.add_argument("--rounds", type=int, default=Study.rounds)
    parser.add_argument("--json", action="store_true", help="print one JSON object a scene")
    options: dict[str, Any] = vars(parser.parse_args(arguments))
    names, device, as_json = (options.pop(name) for name in ("scenes", "device", "json"))
    study = Study(**options)
    display = DisplayProfile.load(DISPLAY)
    try:
        with Renderer(device) as renderer:
            for name in names:
                scene = load(name)
                results = measure(renderer, scene, display, study)
                device_name = renderer.device.name
                if as_json:
                    rows = [dataclasses.asdict(result) for result in results]
                    head = {"scene": scene.name, "triangles": scene.triangle_count}
                    found = {"device": device_name, **dataclasses.asdict(study), "variants": rows}
                    print(json.dumps(head | found), flush=True)
                else:
                    print(f"{scene.name}, {scene.triangle_count:,} triangles, {device_name}\n")
                    print(f"{table(results)}\n", flush=True)
    except LfdError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())

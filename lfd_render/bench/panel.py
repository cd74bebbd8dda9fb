"""What reconstruction, supersampling and continuous angles buy: error against slow pictures.

    python -m lfd_render.bench.panel [--json] [--pictures FOLDER]

Each way renders a panel image of one scene, which is compared

- as it is with the gold standard's panel image (`--preset gold`);
- as the virtual panel shows it to the eyes of some views, with ordinary pictures from there;
- the same to an eye that moves by a part of a view interval from frame to frame: FLIP of each
  frame, and how far the change from frame to frame is from what it should be. What single views
  cannot tell of shows here: views that jump, and pictures that are double between two of them.

Ordinary pictures are MVR's with SAMPLES × SAMPLES samples a pixel, their mean in linear light.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import math
import statistics
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from lfd_render.display import DisplayProfile, Rig, eye_from_slot
from lfd_render.display.files import replacing
from lfd_render.errors import LfdError
from lfd_render.panel.look import look_from
from lfd_render.panel.picture import side_by_side
from lfd_render.quality import flip, rmse, ssim_luma
from lfd_render.renderer import Renderer
from lfd_render.scene import Scene

Pixels = NDArray[np.uint8]
DISPLAY = "gavane-2024-tilted-4k"
SCENE = "builtin:gallery?triangles=100000"

WAYS: dict[str, dict[str, Any]] = {
    "none": {},
    "linear views": {"weave": "linear"},
    "spatial": {"aa": "spatial"},
    "angular": {"aa": "angular"},
    "both": {"aa": "both"},
    "2 × pixels": {"supersample": (2, 1)},
    "2 × eyes": {"supersample": (1, 2)},
    "2 × pixels, spatial": {"supersample": (2, 1), "aa": "spatial"},
    "2 × both, both": {"supersample": (2, 2), "aa": "both"},
    "continuous": {"views": "continuous"},
    "continuous, 2 × pixels, spatial": {
        "views": "continuous",
        "supersample": (2, 1),
        "aa": "spatial",
    },
}
SHOWN = ("none", "spatial", "angular", "both", "continuous")
SHOWN_SLOTS = (-0.34, 0.03, 0.34)  # of the cone: three angles
JPEG_QUALITY = 82


@dataclasses.dataclass(frozen=True)
class Study:
    """What is measured. compared: how many of the views, evenly chosen; frames: of a sweep, which
    moves by `step` of a view interval each; gold_size: pixels of the gold standard's views;
    crosstalk: σ of the virtual lenses' angular response, in views."""

    scene: str = SCENE
    compared: int = 3
    samples: int = 4
    frames: int = 17
    step: float = 0.125
    gold_views: int = 96
    gold_size: tuple[int, int] | None = None
    crosstalk: float = 0.0
    ways: tuple[str, ...] = tuple(WAYS)


@dataclasses.dataclass(frozen=True)
class Result:
    """Errors of one way: RMSE in levels of 255 and SSIM of the panel image and of views, FLIP of a
    sweep's frames and RMSE of their changes; a frame's milliseconds."""

    way: str
    eia_rmse: float
    eia_ssim: float
    view_rmse: float
    view_ssim: float
    sweep_flip: float
    change_rmse: float
    frame_ms: float


class Eyes:
    """Ordinary pictures of a scene, and what the virtual panel shows in their place."""

    def __init__(
        self, renderer: Renderer, scene: Scene, display: DisplayProfile, study: Study
    ) -> None:
        self._renderer, self._scene, self._display, self._study = renderer, scene, display, study
        views = display.views
        chosen = np.unique(np.linspace(0, views - 1, study.compared + 2).round()[1:-1])
        self.views = eye_from_slot((chosen + 0.5) / views - 0.5, display)
        start = views // 2 + 4  # off the middle, so that depth shows
        self.sweep = eye_from_slot(
            (start + study.step * np.arange(study.frames)) / views - 0.5, display
        )
        width_deg = 2 * math.degrees(math.atan(0.5 * display.size_mm[0] / display.distance_mm))
        self.size = look_from(self._blank(), display, (0.0, 0.0, display.distance_mm)).shape[1::-1]
        self.pixels_per_degree = self.size[0] / width_deg

    def _blank(self) -> Pixels:
        width, height = self._display.resolution_px
        return np.zeros((height, width, 3), np.uint8)

    def true(self, eye_x_mm: NDArray[np.float64]) -> list[Pixels]:
        """Pictures from eyes at the viewing distance."""
        display = self._display
        rig = Rig(eye_x_mm, display.distance_mm, display.size_mm, 0.05 * display.distance_mm)
        options: dict[str, Any] = {"technique": "mvr", "supersample": (self._study.samples, 1)}
        return list(
            self._renderer.views(self._scene, display, rig=rig, view_size=self.size, **options)
        )

    def seen(self, eia: Pixels, eye_x_mm: NDArray[np.float64]) -> list[Pixels]:
        """What the virtual panel shows in their place."""
        distance, sigma = self._display.distance_mm, self._study.crosstalk
        return [
            look_from(eia, self._display, (float(x), 0.0, distance), sigma_views=sigma)
            for x in eye_x_mm
        ]


def measure(
    renderer: Renderer,
    display: DisplayProfile,
    study: Study,
    pictures: Path | None = None,
    told: Callable[[Result], None] = lambda _: None,
) -> list[Result]:
    """Every way against the slow pictures; pictures: a folder for what three eyes see, or None.
    told: called with each result as it is found.

    Raises UsageError without scikit-image or flip-evaluator.
    """
    scene = Scene.load(study.scene)
    eyes = Eyes(renderer, scene, display, study)
    true_views, true_sweep = eyes.true(eyes.views), eyes.true(eyes.sweep)
    gold = renderer.render(
        scene,
        display,
        views=study.gold_views,
        view_size=study.gold_size,
        preset="gold",
        linear=False,
    ).pixels
    shown = eye_from_slot(np.array(SHOWN_SLOTS), display)
    if pictures is not None:
        pictures.mkdir(parents=True, exist_ok=True)
        _write(pictures / "panel-camera.jpg", eyes.true(shown))
        _write(pictures / "panel-gold.jpg", eyes.seen(gold, shown))
    results: list[Result] = []
    for way in study.ways:
        eia = renderer.render(scene, display, linear=False, **WAYS[way])
        if pictures is not None and way in SHOWN:
            _write(pictures / f"panel-{way}.jpg", eyes.seen(eia.pixels, shown))
        views, sweep = eyes.seen(eia.pixels, eyes.views), eyes.seen(eia.pixels, eyes.sweep)
        pairs = list(zip(true_views, views, strict=True))
        frames = list(zip(true_sweep, sweep, strict=True))
        results.append(
            Result(
                way,
                rmse(gold, eia.pixels),
                ssim_luma(gold, eia.pixels),
                statistics.fmean(rmse(a, b) for a, b in pairs),
                statistics.fmean(ssim_luma(a, b) for a, b in pairs),
                statistics.fmean(flip(a, b, eyes.pixels_per_degree) for a, b in frames),
                change_error(true_sweep, sweep),
                eia.report["timings_ms"]["frame"],
            )
        )
        told(results[-1])
    return results


def change_error(true: Sequence[Pixels], seen: Sequence[Pixels]) -> float:
    """RMSE of the changes from frame to frame, in levels."""
    wanted, found = (np.diff(np.stack(frames).astype(np.int16), axis=0) for frames in (true, seen))
    return float(np.sqrt(np.mean((found - wanted).astype(np.float64) ** 2)))


def _write(path: Path, pictures: Sequence[Pixels]) -> None:
    """The middle of pictures in a strip, as a JPEG: small, for documents."""
    height, width = pictures[0].shape[:2]
    middle = np.s_[height // 6 : -height // 6, width // 4 : -width // 4]
    with replacing(path) as temporary:
        strip = Image.fromarray(side_by_side([picture[middle] for picture in pictures]))
        strip.save(temporary, format="JPEG", quality=JPEG_QUALITY, subsampling=0)


def table(results: Sequence[Result]) -> str:
    """Results as a Markdown table."""
    lines = [
        "| Way | EIA RMSE | EIA SSIM | view RMSE | view SSIM | sweep FLIP | sweep change | frame |",
        "|---|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {r.way} | {r.eia_rmse:.2f} | {r.eia_ssim:.4f} | {r.view_rmse:.2f} | "
        f"{r.view_ssim:.4f} | {r.sweep_flip:.4f} | {r.change_rmse:.2f} | "
        f"{r.frame_ms / 1000:.1f} s |"
        for r in results
    ]
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """The command; returns its exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--device", default="auto")
    parser.add_argument("--scene", default=Study.scene)
    parser.add_argument("--compared", type=int, default=Study.compared)
    parser.add_argument("--samples", type=int, default=Study.samples)
    parser.add_argument("--frames", type=int, default=Study.frames)
    parser.add_argument("--step", type=float, default=Study.step)
    parser.add_argument("--gold-views", type=int, default=Study.gold_views)
    parser.add_argument("--gold-size", type=int, nargs=2, metavar=("WIDTH", "HEIGHT"))
    parser.add_argument("--crosstalk", type=float, default=Study.crosstalk, metavar="VIEWS")
    parser.add_argument("--ways", nargs="+", choices=list(WAYS), default=list(WAYS))
    parser.add_argument("--pictures", type=Path, metavar="FOLDER")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    options: dict[str, Any] = vars(parser.parse_args(arguments))
    device, as_json, pictures = (options.pop(name) for name in ("device", "json", "pictures"))
    options["ways"] = tuple(options["ways"])
    options["gold_size"] = tuple(options["gold_size"]) if options["gold_size"] else None
    study = Study(**options)
    try:
        with Renderer(device) as renderer:
            results = measure(
                renderer,
                DisplayProfile.load(DISPLAY),
                study,
                pictures,
                told=lambda result: print(result, file=sys.stderr, flush=True),
            )
            device_name = renderer.device.name
    except LfdError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    if as_json:
        rows = [dataclasses.asdict(result) for result in results]
        print(json.dumps({"device": device_name, **dataclasses.asdict(study), "results": rows}))
    else:
        print(f"{device_name}\n\n{table(results)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

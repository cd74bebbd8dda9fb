"""Whether single views by LFDPR are as good as those by MVR: both against the standard.

    python -m lfd_render.bench.baseline SCENE… [--lod RULE] [--json] [--pictures FOLDER]

Each scene is rendered into many views by LFDPR. MVR renders some of the same views from their own
eyes, at the same size and by the same rule for levels of detail; so does the standard
(`bench.gold`), with SAMPLES × SAMPLES samples a pixel. Errors are those in the box of the object.
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

from lfd_render.bench.gold import (
    Pixels,
    alone,
    chosen_views,
    gold_standard,
    likeness,
    write_views,
)
from lfd_render.display import Camera, DisplayProfile
from lfd_render.errors import LfdError
from lfd_render.gpu.layout import LOD_RULES
from lfd_render.renderer import Renderer, camera_for
from lfd_render.scene import Scene

DISPLAY = "gavane-2024-tilted-4k"


@dataclasses.dataclass(frozen=True)
class Study:
    """What is measured. compared: how many of the views, evenly chosen, extremes included."""

    views: int = 48
    view_size: tuple[int, int] = (480, 360)
    compared: int = 3
    samples: int = 8
    lod: str = "anisotropic"
    standard_lod: str = "anisotropic"


@dataclasses.dataclass(frozen=True)
class Result:
    """A scene's mean RMSE (levels of 255) and SSIM over the compared views, by each technique;
    differ: share of those views' pixels in which the two are not the same to the bit."""

    scene: str
    triangles: int
    rmse: float
    ssim: float
    mvr_rmse: float
    mvr_ssim: float
    differ: float

    @property
    def ratio(self) -> float:
        """RMSE over MVR's."""
        return self.rmse / self.mvr_rmse


def measure(
    renderer: Renderer,
    scene: Scene,
    display: DisplayProfile,
    study: Study,
    *,
    camera: Camera | None = None,
    pictures: Path | None = None,
    **options: Any,
) -> Result:
    """One scene. camera: its own, or one that frames it, by default; pictures: a folder for the
    compared views; options: of `RenderOptions`, for LFDPR alone.

    Raises UsageError without scikit-image.
    """
    camera = camera or camera_for(scene, display)
    rig, size = display.rig(study.views), study.view_size
    chosen = chosen_views(rig.views, study.compared)
    ours = renderer.views(
        scene,
        display,
        camera,
        rig=rig,
        view_size=size,
        **{"lod": study.lod, "shade": "ray", **options},
    )[chosen]
    theirs, standard = [], []
    for view in chosen:
        eye = alone(rig, view)
        theirs.append(
            renderer.views(
                scene, display, camera, rig=eye, view_size=size, technique="mvr", lod=study.lod
            )[0]
        )
        standard.append(
            gold_standard(
                renderer, scene, display, camera, eye=eye, view_size=size,
                samples=study.samples, lod=study.standard_lod,
            )
        )  # fmt: skip
    if pictures is not None:
        stacks = {"lfdpr": ours, "mvr": np.stack(theirs), "standard": np.stack(standard)}
        write_views(pictures / scene.name, chosen, stacks)
    return Result(
        scene.name,
        scene.triangle_count,
        *_mean(list(ours), standard),
        *_mean(theirs, standard),
        float(np.mean((ours != np.stack(theirs)).any(axis=-1))),
    )


def _mean(pictures: list[Pixels], standard: list[Pixels]) -> tuple[float, float]:
    found = [likeness(a, b) for a, b in zip(pictures, standard, strict=True)]
    return statistics.fmean(f[0] for f in found), statistics.fmean(f[1] for f in found)


def table(results: Sequence[Result]) -> str:
    """Results as a Markdown table."""
    lines = [
        "| Scene | triangles | RMSE | of MVR | ratio | SSIM | of MVR | pixels that differ |",
        "|---|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {r.scene} | {r.triangles:,} | {r.rmse:.3f} | {r.mvr_rmse:.3f} | {r.ratio:.4f} | "
        f"{r.ssim:.5f} | {r.mvr_ssim:.5f} | {100 * r.differ:.3f} % |"
        for r in results
    ]
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """The command; returns its exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("scenes", nargs="+", metavar="SCENE", help="as `lfd-render render` takes")
    parser.add_argument("--device", default="auto")
    parser.add_argument("--views", type=int, default=Study.views)
    parser.add_argument("--compared", type=int, default=Study.compared)
    parser.add_argument("--samples", type=int, default=Study.samples)
    parser.add_argument("--lod", choices=[r for r in LOD_RULES if r != "multiview"])
    parser.add_argument("--pictures", type=Path, metavar="FOLDER")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    options: dict[str, Any] = vars(parser.parse_args(arguments))
    scenes, device, as_json, pictures = (
        options.pop(name) for name in ("scenes", "device", "json", "pictures")
    )
    study = Study(**{key: value for key, value in options.items() if value is not None})
    try:
        display = DisplayProfile.load(DISPLAY)
        with Renderer(device) as renderer:
            results = [
                measure(renderer, Scene.load(name), display, study, pictures=pictures)
                for name in scenes
            ]
            device_name = renderer.device.name
    except LfdError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    if as_json:
        rows = [{**dataclasses.asdict(result), "ratio": result.ratio} for result in results]
        print(json.dumps({"device": device_name, **dataclasses.asdict(study), "scenes": rows}))
    else:
        print(f"{device_name}\n\n{table(results)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

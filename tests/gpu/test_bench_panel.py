"""The study of panel images, small: what it must show."""

from pathlib import Path

import numpy as np
import pytest

from lfd_render.bench.panel import SHOWN, Study, change_error, measure, table
from lfd_render.gpu.device import Device
from lfd_render.panel.picture import read_picture
from lfd_render.renderer import Renderer

from .helpers import PAPER, few_lenses

pytestmark = pytest.mark.needs("gl")


def test_finer_angles_lower_the_error_of_a_sweep(device: Device, tmp_path: Path) -> None:
    lens = few_lenses(PAPER, 60.1, (480, 270))
    display = lens.model_copy(update={"viewing": lens.viewing.model_copy(update={"views": 12})})
    study = Study(
        scene="builtin:gallery?triangles=2000", compared=1, samples=2, frames=5, gold_views=8,
        gold_size=(240, 136), ways=("none", "both", "continuous"),
    )  # fmt: skip
    with Renderer(device) as renderer:
        results = {r.way: r for r in measure(renderer, display, study, tmp_path)}
    none, both, continuous = (results[way] for way in study.ways)
    assert continuous.sweep_flip < none.sweep_flip
    assert continuous.view_rmse < none.view_rmse - 0.4
    assert both.eia_rmse < none.eia_rmse  # as the standard is filtered too
    assert len(table(list(results.values())).splitlines()) == 2 + len(results)
    shown = {path.stem for path in tmp_path.iterdir()}
    assert shown == {"panel-camera", "panel-gold"} | {
        f"panel-{w}" for w in study.ways if w in SHOWN
    }
    assert read_picture(tmp_path / "panel-none.jpg").std() > 20


def test_changes_are_those_from_frame_to_frame() -> None:
    still = [np.full((4, 5, 3), 100, np.uint8)] * 3
    jumps = [still[0], still[0] + np.uint8(30), still[0] + np.uint8(30)]
    assert change_error(still, jumps) == pytest.approx(30 / np.sqrt(2))
    assert change_error(jumps, jumps) == 0.0
    lighter = [frame + np.uint8(50) for frame in still]
    assert change_error(still, lighter) == 0.0  # lighter, but as still

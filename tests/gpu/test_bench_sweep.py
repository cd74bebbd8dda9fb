"""What an eye sees that moves, small: what it must show."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from lfd_render.bench.contenders import Contender
from lfd_render.bench.measure import Bench, Effort
from lfd_render.bench.suites import Group
from lfd_render.bench.sweep import change_error
from lfd_render.gpu.device import Device
from lfd_render.panel.picture import read_picture, write_png

from .helpers import PAPER, few_lenses

pytestmark = pytest.mark.needs("gl")


def test_finer_angles_lower_the_error_of_a_sweep(device: Device, tmp_path: Path) -> None:
    lens = few_lenses(PAPER, 60.1, (480, 270))
    display = lens.model_copy(update={"viewing": lens.viewing.model_copy(update={"views": 12})})
    effort = Effort(rounds=1, compared=1, samples=2, swept=5, gold_views=8, gold_size=(240, 136))
    contenders = (
        Contender("lfdpr"),
        Contender("lfdpr", "both"),
        Contender("lfdpr", idea="continuous angles"),
    )
    shown = dict.fromkeys(contenders, ("sweep",))
    group = Group("builtin:gallery?triangles=2000", 12, (1, 1), shown)
    none, both, continuous = Bench(device, display, effort, keep=tmp_path).rows(group)
    assert continuous.sweep_flip < none.sweep_flip
    assert continuous.fault is None
    assert both.eia_rmse < none.eia_rmse  # as the standard is filtered too
    (kept,) = tmp_path.glob("gold-*.png")
    write_png(kept, 255 - read_picture(kept))  # which the next run takes as it is
    alone = dataclasses.replace(group, contenders={Contender("lfdpr"): ("error",)})
    (again,) = Bench(device, display, effort, keep=tmp_path).rows(alone)
    assert again.eia_rmse > 4 * none.eia_rmse


def test_changes_are_those_from_frame_to_frame() -> None:
    still = [np.full((4, 5, 3), 100, np.uint8)] * 3
    jumps = [still[0], still[0] + np.uint8(30), still[0] + np.uint8(30)]
    assert change_error(still, jumps) == pytest.approx(30 / np.sqrt(2))
    assert change_error(jumps, jumps) == 0.0
    lighter = [frame + np.uint8(50) for frame in still]
    assert change_error(still, lighter) == 0.0  # lighter, but as still

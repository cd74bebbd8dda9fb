"""The study of levels of detail, small: what it must show."""

import pytest

from lfd_render.bench.lod import DISPLAY, Study, measure, table
from lfd_render.display import DisplayProfile
from lfd_render.gpu.device import Device
from lfd_render.renderer import Renderer

pytestmark = pytest.mark.needs("gl")


def test_each_better_rule_lowers_the_error(device: Device) -> None:
    study = Study(views=5, view_size=(160, 120), compared=3, samples=4, frames=1, rounds=1)
    with Renderer(device) as renderer:
        results = {r.rule: r for r in measure(renderer, DisplayProfile.load(DISPLAY), study)}
    error = {rule: result.rmse for rule, result in results.items()}
    assert error["anisotropic"] < 0.5 * error["multiview"] < 0.5 * error["none"]
    assert results["anisotropic"].ssim > results["multiview"].ssim > results["none"].ssim
    assert len(table(list(results.values())).splitlines()) == 2 + len(results)

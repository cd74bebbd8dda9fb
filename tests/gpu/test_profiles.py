"""What profiles can say beyond plain stripes, woven on the device: the published golden maps, and
the mixing and filtering rules against the reference."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from lfd_render.display import DisplayProfile, Reconstruction, ViewGrid
from lfd_render.display.model import PhaseCorrection, Stripes
from lfd_render.display.mount import stored
from lfd_render.gpu.device import Device
from lfd_render.panel.eia import Eia, read_eia
from lfd_render.passes.view_target import ViewTarget
from lfd_render.passes.weave import Weave
from lfd_render.reference import woven

from .helpers import PAPER, few_lenses, fill

pytestmark = pytest.mark.needs("gl")

SUITE = Path(__file__).resolve().parents[2] / "docs" / "conformance"


@contextmanager
def weaving(
    device: Device, profile: DisplayProfile, grid: ViewGrid, views: int, rule: Reconstruction
) -> Iterator[tuple[ViewTarget, Weave]]:
    target = ViewTarget(device, profile.rig(views), grid, [], halo=rule.halo)
    step = Weave(device, profile, grid, views, rule)
    try:
        yield target, step
    finally:
        step.release()
        target.release()


def panel_of(
    device: Device,
    profile: DisplayProfile,
    grid: ViewGrid,
    images: NDArray[np.floating],
    rule: Reconstruction | None = None,
) -> NDArray[np.float16]:
    """Panel image of views [view, row, column, rgb], which fit one band."""
    with weaving(device, profile, grid, len(images), rule or Reconstruction()) as (target, step):
        (band,) = target.bands
        fill(device, target.images, images)
        step(band.view_images())
        return step.read_linear()


def index_on_device(device: Device, profile: DisplayProfile, views: int) -> NDArray[np.uint16]:
    grid = ViewGrid.lens(profile, min(5, profile.resolution_px[1]))
    numbers = np.arange(views, dtype=np.float16)[:, None, None, None]
    images = np.broadcast_to(numbers, (views, grid.rows, grid.columns, 3))
    return panel_of(device, profile, grid, images).astype(np.uint16)


@pytest.mark.shows("the conformance suite's maps, on the GPU")
def test_the_device_gives_the_golden_maps(device: Device) -> None:
    paths = sorted((SUITE / "cases").glob("*.json"))
    assert len(paths) >= 50
    for path in paths:
        profile, views, expected = read_case(path)
        index = stored(index_on_device(device, profile, views), profile.panel.mount)
        assert np.array_equal(index, expected), path.stem


@pytest.mark.shows("the two known mistakes are refused, on the GPU")
@pytest.mark.parametrize("name", ["over-width-less-one", "without-half-pixel"])
def test_the_device_does_not_give_the_mistakes(device: Device, name: str) -> None:
    profile, views, wrong = read_case(SUITE / "controls" / f"{name}.json")
    index = index_on_device(device, profile, views)
    assert np.count_nonzero(index != wrong) > 0.5 * index.size
    np.testing.assert_array_equal(index, profile.view_index_map(views))


def read_case(path: Path) -> tuple[DisplayProfile, int, NDArray[np.uint16]]:
    case: dict[str, Any] = json.loads(path.read_text("utf-8"))
    told = case["input"]
    text = told if isinstance(told, str) else json.dumps(told)
    rows = np.array(case["map"], np.uint16)
    return DisplayProfile.from_json(text, path.stem), case["views"], rows.reshape(len(rows), -1, 3)


def unusual(rng: np.random.Generator) -> DisplayProfile:
    """Inverted views, a correction, and blue, green and red above each other."""
    base = few_lenses(PAPER, 37.7, (322, 210))
    grid = tuple(map(tuple, rng.normal(0, 0.15, (3, 4)).tolist()))
    stripes = Stripes(order="bgr", origin="green-at-pixel-centre", axis="up")
    return base.model_copy(
        update={
            "panel": base.panel.model_copy(update={"subpixels": stripes}),
            "viewing": base.viewing.model_copy(update={"inverted": True}),
            "correction": PhaseCorrection(phase_lenses=grid),
        }
    )


RULES = {
    "nearest": Reconstruction(),
    "linear views": Reconstruction(weave="linear"),
    "at the subpixel": Reconstruction(lookup="subpixel"),
    "angular": Reconstruction(aa="angular"),
    "both": Reconstruction(aa="both"),
}


@pytest.mark.parametrize("mixing", RULES)
def test_rules_hold_for_unusual_panels(
    device: Device, rng: np.random.Generator, mixing: str
) -> None:
    rule, profile = RULES[mixing], unusual(rng)
    grid = ViewGrid.lens(profile, 24)
    images = rng.uniform(0.0, 1.0, (7, grid.rows, grid.columns, 3)).astype(np.float16)
    panel = panel_of(device, profile, grid, images, rule)
    # Tolerances as in test_weave.py: columns in single precision, half floats' step.
    wrong = np.abs(panel - woven(images, profile, grid, rule)) > 4 * 8e-6 + 2.0**-10
    assert wrong.mean() < (2e-4 if rule.lookup == "subpixel" else 1e-9)
    # Planted faults: views the other way round, no correction.
    for change in (
        {"viewing": profile.viewing.model_copy(update={"inverted": False})},
        {"correction": None},
    ):
        other = woven(images, profile.model_copy(update=change), grid, rule)
        assert (np.abs(panel - other) > 0.01).mean() > 0.3


def test_files_lie_as_the_panel_takes_them(tmp_path: Path, rng: np.random.Generator) -> None:
    profile, _, _ = read_case(SUITE / "cases" / "mount-90-flip-x.json")
    width, height = profile.resolution_px
    pixels = rng.integers(0, 256, (height, width, 3), dtype=np.uint8)
    Eia(pixels, None, mount=profile.panel.mount).save(tmp_path / "eia.png")
    read = read_eia(tmp_path / "eia.png", profile)
    np.testing.assert_array_equal(read.pixels, pixels)
    plain = profile.model_copy(
        update={
            "panel": profile.panel.model_copy(
                update={"mount": None, "resolution_px": (height, width)}
            )
        }
    )
    # Flipped left to right, then a quarter turn counter-clockwise: rows become columns.
    np.testing.assert_array_equal(
        read_eia(tmp_path / "eia.png", plain).pixels, np.swapaxes(pixels, 0, 1)
    )

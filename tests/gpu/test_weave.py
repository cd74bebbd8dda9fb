"""Weaving against the float64 definition: every subpixel of every shipped display.

View number and lens column travel as colours of the view images. Half floats hold integers up to
2048 exactly, so they are read back as integers.
"""

import dataclasses
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from numpy.typing import NDArray

from lfd_render.display import DisplayProfile, Reconstruction, ViewGrid
from lfd_render.display.profile import shipped_profiles
from lfd_render.gpu.device import Device
from lfd_render.passes import view_target
from lfd_render.passes.view_target import ViewTarget
from lfd_render.passes.weave import Weave
from lfd_render.reference import weave, woven

from .helpers import DISPLAYS, PAPER, few_lenses, fill

pytestmark = pytest.mark.needs("gl")

Panel = NDArray[np.float16]


@contextmanager
def woven_by_device(
    device: Device,
    profile: DisplayProfile,
    grid: ViewGrid,
    views: int,
    rule: Reconstruction = weave.NEAREST,
) -> Iterator[Callable[[Callable[[int, slice], NDArray[np.floating]]], Panel]]:
    """A function that weaves images, given as ``images(view, rows)`` → [row, column, rgb]."""
    before = device.ledger.total
    target = ViewTarget(device, profile.rig(views), grid, [], halo=rule.halo)
    step = Weave(device, profile, grid, views, rule)

    def weave_images(images: Callable[[int, slice], NDArray[np.floating]]) -> Panel:
        for band in target.bands:
            rows = slice(band.first, band.first + band.rows)
            layers = np.stack([images(view, rows) for view in range(views)])
            fill(device, target.images, layers)
            step(band.view_images())
        return step.read_linear()

    try:
        yield weave_images
    finally:
        step.release()
        target.release()
    assert device.ledger.total == before


def as_colour(values: NDArray[np.floating]) -> NDArray[np.floating]:
    """[row, column] → the same in all three channels."""
    return np.repeat(values[..., None], 3, axis=-1)


# ---- which view, which column -----------------------------------------------------------------


@pytest.mark.shows("the view-index map of each sample unit on every subpixel, on the GPU")
@pytest.mark.parametrize("name", shipped_profiles())
def test_every_subpixel_takes_its_view_at_its_lens(device: Device, name: str) -> None:
    profile = DisplayProfile.load(name)
    views = 48
    grid = ViewGrid.lens(profile, ViewGrid.default_rows(profile, views))
    columns = np.broadcast_to(np.arange(grid.columns), (grid.rows, grid.columns))
    with woven_by_device(device, profile, grid, views) as weave_images:
        view = weave_images(lambda view, rows: as_colour(np.full_like(columns[rows], view)))
        column = weave_images(lambda _, rows: as_colour(columns[rows]))
    assert wrong_views(view, profile.view_index_map(views)) == 0
    # And the formula itself. The lens of a subpixel is ⌊φ⌋; a view shows it in column lens − base.
    height = profile.resolution_px[1]
    row = ((np.arange(height) + 0.5) / height * grid.rows).astype(int)
    wrong = borderline = 0
    for start in range(0, height, 256):  # a 4K panel's phases would take 200 MB
        part = slice(start, start + 256)
        phase = formula(profile, part)
        lens = np.floor(phase).astype(int) - grid.row_base[row[part], None, None]
        differs = column[part] != np.clip(lens, 0, grid.columns - 1)
        differs |= view[part] != weave.view_of(phase, views)
        # On the very boundary of two views rounding decides, 2⁻³² of a view here and 2⁻⁴³ there.
        slots = phase * views
        on_boundary = np.abs(slots - np.rint(slots)) < 2.0**-31
        wrong += np.count_nonzero(differs & ~on_boundary)
        borderline += np.count_nonzero(on_boundary)
    assert wrong == 0
    assert borderline < 1e-5 * view.size


def formula(profile: DisplayProfile, rows: slice) -> NDArray[np.float64]:
    """φ = (u + c/(3W) + v·T)·P − center of the rows' subpixels, v counted from the bottom."""
    width, height = profile.resolution_px
    u = (np.arange(width) + 0.5) / width
    v = (height - 0.5 - np.arange(height)[rows]) / height
    return _phase(u, v, width, profile)


def _phase(
    u: NDArray[np.float64], v: NDArray[np.float64], width: int, profile: DisplayProfile
) -> NDArray[np.float64]:
    stripe = np.arange(3) / (3 * width)
    across = u[None, :, None] + stripe + (v * profile.drift)[:, None, None]
    return across * profile.lens_count - profile.center


def wrong_views(found: Panel, expected: NDArray[np.integer]) -> int:
    return int(np.count_nonzero(found != expected))


def without_half_pixel(profile: DisplayProfile) -> NDArray[np.float64]:
    """A known mistake: u and v of a pixel's corner."""
    width, height = profile.resolution_px
    return _phase(np.arange(width) / width, np.arange(height)[::-1] / height, width, profile)


def over_width_less_one(profile: DisplayProfile) -> NDArray[np.float64]:
    """A known mistake: the last pixel's u and v are 1."""
    width, height = profile.resolution_px
    u, v = np.arange(width) / (width - 1), np.arange(height)[::-1] / (height - 1)
    return _phase(u, v, width, profile)


@pytest.mark.shows("the two known-wrong view formulas are caught")
@pytest.mark.parametrize("mistake", [without_half_pixel, over_width_less_one])
def test_known_wrong_formulas_are_caught(
    device: Device, mistake: Callable[[DisplayProfile], NDArray[np.float64]]
) -> None:
    profile = DisplayProfile.load("looking-glass-portrait-sample-a")
    grid = ViewGrid.lens(profile, 64)
    with woven_by_device(device, profile, grid, 48) as weave_images:
        view = weave_images(
            lambda view, rows: np.full((rows.stop - rows.start, grid.columns, 3), float(view))
        )
    total = view.size
    assert wrong_views(view, profile.view_index_map(48)) == 0
    wrong = weave.view_of(mistake(profile), 48)
    assert wrong_views(view, wrong) > 0.5 * total


@pytest.mark.parametrize("views", [1, 2, 7, 100, 1000])
def test_any_number_of_views(device: Device, views: int) -> None:
    profile = DisplayProfile.load("looking-glass-8_9-sample-c")
    grid = ViewGrid.lens(profile, 3)
    with woven_by_device(device, profile, grid, views) as weave_images:
        view = weave_images(
            lambda view, rows: np.full((rows.stop - rows.start, grid.columns, 3), float(view))
        )
    assert wrong_views(view, profile.view_index_map(views)) == 0


CELLS = {
    "schema": "lfd-display/1",
    "name": "cells",
    "panel": {
        "resolution_px": [96, 64],
        "size_mm": [96.0, 64.0],
        "subpixels": {"layout": "cells", "pattern_mode": 0, "offsets_px": []},
    },
    "lens": {"lens_count": 11.3, "drift": -0.21, "center": 0.37},
    "viewing": {"views": 9, "cone_deg": 40.0, "distance_mm": 300.0, "spacing": "lens"},
}


@pytest.mark.parametrize("mode", range(5))
def test_subpixel_cells(device: Device, rng: np.random.Generator, mode: int) -> None:
    """Panels whose subpixels stand in cells, each pattern of them."""
    profile = cells_profile(rng, mode)
    assert profile.phase_tables().pattern_mode == mode
    grid = ViewGrid.lens(profile, 16)
    with woven_by_device(device, profile, grid, 9) as weave_images:
        view = weave_images(
            lambda view, rows: np.full((rows.stop - rows.start, grid.columns, 3), float(view))
        )
    expected = profile.view_index_map(9)
    assert wrong_views(view, expected) == 0
    assert wrong_views(view, np.roll(expected, 1, axis=0)) > 0  # the planted fault of a parity


def cells_profile(rng: np.random.Generator, mode: int) -> DisplayProfile:
    data = json.loads(json.dumps(CELLS))
    cells = {0: 1, 1: 2, 2: 2, 3: 4, 4: 2}[mode]
    subpixels = data["panel"]["subpixels"]
    subpixels["pattern_mode"] = mode
    subpixels["offsets_px"] = rng.uniform(-0.5, 0.5, (cells, 3, 2)).round(3).tolist()
    return DisplayProfile.from_json(json.dumps(data))


# ---- what it shows ----------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["lens", "upright"])
@pytest.mark.parametrize("name", DISPLAYS)
def test_panels_show_what_the_definition_says(
    device: Device, rng: np.random.Generator, name: str, kind: str
) -> None:
    profile = few_lenses(name, 37.7, (640, 420))
    grid = ViewGrid.lens(profile, 24) if kind == "lens" else ViewGrid.upright(profile, 41, 24)
    images = rng.uniform(0.0, 4.0, (5, grid.rows, grid.columns, 3)).astype(np.float16)
    with woven_by_device(device, profile, grid, 5) as weave_images:
        panel = weave_images(lambda view, rows: images[view, rows])
    assert wrong_pixels(panel, images, profile, grid) == 0
    # Planted faults: views counted from the right, rows from the bottom.
    assert wrong_pixels(panel, images[::-1], profile, grid) > 0
    assert wrong_pixels(panel, images[:, ::-1], profile, grid) > 0


def wrong_pixels(
    panel: Panel, images: NDArray[np.float16], profile: DisplayProfile, grid: ViewGrid
) -> int:
    expected = woven(images, profile, grid)
    if grid.kind == "lens":
        return int(np.count_nonzero(panel != expected))
    # float32 columns of up to 41 are off by 8e-6 of two colours' difference, half floats by a step
    # of 2⁻¹⁰, since llvmpipe cuts where others round.
    return int(np.count_nonzero(np.abs(panel - expected) > 4 * 8e-6 + 2.0**-10 * expected))


def test_upright_views_mix_two_columns(device: Device) -> None:
    """A ramp over columns comes out as the lens centres' positions; nearest columns would not."""
    profile = few_lenses(PAPER, 37.7, (640, 420))
    grid = ViewGrid.upright(profile, 41, 24)
    ramp = as_colour(np.broadcast_to(np.arange(41.0), (24, 41)))
    with woven_by_device(device, profile, grid, 2) as weave_images:
        panel = weave_images(lambda _, rows: ramp[rows]).astype(np.float64)
    height = profile.resolution_px[1]
    v = ((height - np.arange(height) - 0.5) / height)[:, None, None]
    lens = np.floor(profile.phase_map())
    u = (lens + 0.5 + profile.center) / profile.lens_count - v * profile.drift
    expected = np.clip(u * 41 - 0.5, 0, 40)
    assert np.abs(panel - expected).max() < 2.0**-5 + 1e-5  # a step of half floats up to 64
    assert np.abs(np.rint(expected) - expected).max() > 0.4


def test_bands_leave_no_seam(device: Device, rng: np.random.Generator) -> None:
    profile = few_lenses(PAPER, 37.7, (640, 420))
    grid = ViewGrid.lens(profile, 29)
    images = rng.uniform(0.0, 1.0, (3, grid.rows, grid.columns, 3)).astype(np.float16)

    def panel() -> Panel:
        with woven_by_device(device, profile, grid, 3) as weave_images:
            return weave_images(lambda view, rows: images[view, rows])

    whole = panel()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(view_target, "BAND_BYTES", 4 * 4 * 3 * grid.columns)
        np.testing.assert_array_equal(panel(), whole)


def test_the_reference_agrees_with_the_display() -> None:
    profile = DisplayProfile.load("looking-glass-portrait-sample-b")
    part = slice(700, 760)
    view = weave.view_of(profile.phase_tables().phase(part), 48)
    np.testing.assert_array_equal(view, profile.view_index_map(48)[part])


# ---- interpolated and filtered ----------------------------------------------------------------

RULES = {
    "linear views": Reconstruction(weave="linear"),
    "at the subpixel": Reconstruction(lookup="subpixel"),
    "at the subpixel, linear views": Reconstruction(lookup="subpixel", weave="linear"),
    "spatial": Reconstruction(aa="spatial"),
    "angular": Reconstruction(aa="angular"),
    "both": Reconstruction(aa="both"),
    "both, at the subpixel": Reconstruction(lookup="subpixel", aa="both"),
    "wide": Reconstruction(aa="both", samples=32, pixel=(2.5, 3.0)),
}


@pytest.mark.parametrize("kind", ["lens", "upright", "finer"])
@pytest.mark.parametrize("mixing", RULES)
def test_rules_show_what_the_definition_says(
    device: Device, rng: np.random.Generator, mixing: str, kind: str
) -> None:
    rule = RULES[mixing]
    if kind == "finer" and rule.aa == "none":
        return  # finer views are averaged or filtered
    profile = cells_profile(rng, 3) if kind == "upright" else few_lenses(PAPER, 37.7, (322, 210))
    grid = ViewGrid.upright(profile, 41, 24) if kind == "upright" else ViewGrid.lens(profile, 24)
    if kind == "finer":
        grid = grid.finer(profile, 2)
    images = rng.uniform(0.0, 1.0, (7, grid.rows, grid.columns, 3)).astype(np.float16)
    with woven_by_device(device, profile, grid, 7, rule) as weave_images:
        panel = weave_images(lambda view, rows: images[view, rows])
    expected = woven(images, profile, grid, rule)
    wrong = np.abs(panel - expected) > 4 * 8e-6 + 2.0**-10
    # In single precision a sample at a column's boundary may fall into the other: where columns are
    # whole lenses 0 were found, elsewhere up to 6e-5 of the subpixels.
    assert wrong.mean() < (2e-4 if kind == "upright" or rule.lookup == "subpixel" else 1e-9)
    # Planted fault: views mirrored.
    mirrored = woven(images[::-1], profile, grid, rule)
    assert (np.abs(panel - mirrored) > 0.01).mean() > 0.5


@pytest.mark.parametrize("aa", ["spatial", "both"])
def test_filters_leave_no_seam_between_bands(
    device: Device, rng: np.random.Generator, aa: str
) -> None:
    profile = few_lenses(PAPER, 37.7, (322, 210))
    grid = ViewGrid.lens(profile, 29)
    rule = Reconstruction(aa=aa)
    images = rng.uniform(0.0, 1.0, (3, grid.rows, grid.columns, 3)).astype(np.float16)

    def panel() -> Panel:
        with woven_by_device(device, profile, grid, 3, rule) as weave_images:
            return weave_images(lambda view, rows: images[view, rows])

    whole = panel()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(view_target, "BAND_BYTES", 4 * 7 * 3 * grid.columns)
        np.testing.assert_array_equal(panel(), whole)
        patch.setattr(Reconstruction, "halo", property(lambda _: 0))  # the planted fault
        assert not np.array_equal(panel(), whole)


def test_work_groups_of_any_width_weave_the_same(device: Device, rng: np.random.Generator) -> None:
    """Of software and of hardware, on a panel of an odd number of columns."""
    profile = few_lenses(PAPER, 37.7, (321, 210))
    grid = ViewGrid.lens(profile, 24)
    target = ViewTarget(device, profile.rig(7), grid, [])
    fill(device, target.images, rng.uniform(0.0, 1.0, (7, grid.rows, grid.columns, 3)))
    panels = []
    for software in (True, False):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(device, "info", dataclasses.replace(device.info, software=software))
            step = Weave(device, profile, grid, 7)
            step(target.bands[0])
            panels.append(step.read_linear())
            step.release()
    np.testing.assert_array_equal(*panels)
    assert panels[0].min(axis=(0, 2)).max() > 0.0  # no column is left out
    target.release()

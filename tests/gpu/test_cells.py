"""The paper's lattice: its cells against the reference, and its pictures against those of rows."""

import dataclasses
from contextlib import nullcontext

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from lfd_render.display import DisplayProfile, Rig, ViewGrid
from lfd_render.gpu.device import Device
from lfd_render.gpu.layout import dtype
from lfd_render.passes import cells, owned, raster_cells, view_target
from lfd_render.passes.sampling import PAPER_SAMPLING, Sampling
from lfd_render.reference import Triangles
from lfd_render.reference.cells import MOST_CELLS, lattice_of
from lfd_render.scene import Image, Instance, Material, Scene, TextureSlot

from .helpers import (
    DISPLAYS,
    PAPER,
    Passes,
    Winners,
    examples,
    mesh_of,
    passes,
    random_camera,
    random_grid,
    random_scene,
    scene_of,
)

pytestmark = pytest.mark.needs("gl")

seeds = st.integers(0, 2**32 - 1)
CELLS = Sampling(lattice="paper")
RASTER = Sampling(lattice="paper", source="raster")
sources = pytest.mark.parametrize("sampling", [CELLS, RASTER], ids=["compute", "raster"])

# The device takes cells that come within a thousandth of the triangle (ROUNDING_CELLS of
# shaders/cells/lattice.glsl) along each axis, and its coordinates are off by far less.
CELL_MARGIN = 2e-3
# Relative, of lattice steps: sums and roots of terms that do not cancel, 12 roundings measured
# at most where the plane is not within a thousandth of edge-on to an eye.
STEP_TOLERANCE = 1e-4


def listed(opened: Passes) -> list[tuple[int, int, int]]:
    """All cells that the device lists: global triangle, u, v."""
    found = []
    for band in opened.target.bands:
        for batch, points in opened.batches:
            opened.sample(batch, points, band)
            for window in range(points.windows):
                opened.sample.fill(batch, points, band, window)
                count = int(points.work.read(dtype("CellWork"))["points"][0])
                for triangle, cell in points.cells.read(dtype("Cell"))[:count].tolist():
                    found.append((batch.triangle_base + triangle, cell & 0xFFFF, cell >> 16))
    return found


def steps_mm(opened: Passes) -> NDArray[np.float32]:
    """Steps of all lattices, [triangle, 2]; of triangles that nobody sees, anything."""
    return np.concatenate(
        [points.steps_mm.read(np.float32).reshape(-1, 2) for _, points in opened.batches]
    )


def small_scene(rng: np.random.Generator, profile: DisplayProfile) -> Scene:
    """Triangles well within the window, turned all ways, some coarsely textured."""
    width, height = profile.size_mm
    corners = rng.uniform(-0.15, 0.15, (12, 3, 3)) * (width, height, height)
    corners += rng.uniform(-0.2, 0.2, (12, 1, 3)) * (width, height, height)
    image = Image("coarse", rng.integers(0, 256, (4, 8, 4)).astype(np.uint8))
    both = {"double_sided": True}
    materials = (
        Material("plain", **both),
        Material("coarse", **both, base_color_texture=TextureSlot(0)),
    )
    texcoords = rng.uniform(-1.0, 1.0, (6, 3, 2, 2))
    meshes = mesh_of(corners[:6]), mesh_of(corners[6:], 1, texcoords=texcoords)
    instances = tuple(Instance(mesh.name, i, np.eye(4)) for i, mesh in enumerate(meshes))
    return Scene("small", meshes, instances, materials, (image,))


# ---- cells ------------------------------------------------------------------------------------


@sources
@examples(4)
@given(seed=seeds, isotropic=st.booleans(), texture_limit=st.booleans())
def test_lattices_and_their_cells_are_the_references(
    device: Device, sampling: Sampling, seed: int, isotropic: bool, texture_limit: bool
) -> None:
    rng = np.random.default_rng(seed)
    profile = DisplayProfile.load(DISPLAYS[rng.integers(len(DISPLAYS))])
    rig, grid = profile.rig(int(rng.choice([1, 7, 48]))), ViewGrid.upright(profile, 48, 36)
    scene = small_scene(rng, profile)
    density = "isotropic" if isotropic else "lfd"
    sampling = dataclasses.replace(sampling, density=density, texture_limit=texture_limit)
    with passes(device, scene, rig, grid, sampling=sampling) as opened:
        found, steps, triangles = listed(opened), steps_mm(opened), opened.triangles()
    assert len(found) == len(set(found)) > 0
    by_triangle: dict[int, set[tuple[int, int]]] = {}
    for index, u, v in found:
        by_triangle.setdefault(index, set()).add((u, v))
    for index, touched in by_triangle.items():
        lattice = lattice_of(
            scene, triangles, index, rig, grid, isotropic=isotropic, texture_limit=texture_limit
        )
        if not edge_on(triangles, index, rig):
            assert steps[index] == pytest.approx(lattice.step_mm, rel=STEP_TOLERANCE)
        # With the device's own steps cells stand where it has them.
        lattice = dataclasses.replace(
            lattice,
            step_mm=steps[index].astype(float),
            corners=lattice.corners * lattice.step_mm / steps[index],
        )
        assert all(lattice.touches(cell, CELL_MARGIN) for cell in touched)
        columns, rows = lattice.counts
        every = {(u, v) for u in range(columns) for v in range(rows)}
        missing = [c for c in every - touched if lattice.touches(c, -CELL_MARGIN)]
        assert all(unseen(lattice, cell, rig, grid) for cell in missing)


def edge_on(triangles: Triangles, index: int, rig: Rig) -> bool:
    """Whether an eye sees a plane so nearly edge-on that float32 does not tell how nearly."""
    a, b, c = triangles.p_display[index]
    normal = np.cross(b - a, c - a)
    rays = np.stack([rig.eye_x_mm, 0 * rig.eye_x_mm, 0 * rig.eye_x_mm + rig.distance_mm], axis=1)
    rays = rays - a
    cosines = np.abs(rays @ normal) / np.linalg.norm(normal) / np.linalg.norm(rays, axis=1)
    return bool(cosines.min() < 1e-3)


def unseen(lattice, cell: tuple[int, int], rig: Rig, grid: ViewGrid) -> bool:
    """Whether no row's centre lies in a cell, as every view sees it."""
    ends = (np.array([(0, 0), (1, 0), (1, 1), (0, 1)]) + cell) * lattice.step_mm
    p = lattice.origin_mm + ends @ lattice.axes
    y_mm = p[:, 1] * rig.distance_mm / (rig.distance_mm - p[:, 2])
    rows = (0.5 * grid.panel_mm[1] - y_mm) * grid.rows / grid.panel_mm[1] - 0.5
    return bool(np.ceil(rows.min()) > np.floor(rows.max()))


@examples(5)
@given(seed=seeds)
def test_raster_makes_the_points_that_compute_makes(device: Device, seed: int) -> None:
    scene, rig, grid, placed = random_case(seed)
    with passes(device, scene, rig, grid, placed, sampling=CELLS) as opened:
        expected = sorted(listed(opened))
    with passes(device, scene, rig, grid, placed, sampling=RASTER) as opened:
        found = sorted(listed(opened))
    assert found == expected
    assert len(expected) > 100


def test_boxes_are_drawn_where_the_driver_does_not_raster_conservatively(
    device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without either, cells that a triangle only touches would be lost; that this shows is what
    keeps the test above from passing on drivers whose raster misses some."""
    scene, rig, grid, placed = random_case(7)
    with passes(device, scene, rig, grid, placed, sampling=RASTER) as opened:
        whole = set(listed(opened))
    extensions = device.info.extensions | {raster_cells.CONSERVATIVE}
    monkeypatch.setattr(device, "info", dataclasses.replace(device.info, extensions=extensions))
    monkeypatch.setattr(raster_cells, "conservative_raster", lambda *_: nullcontext())
    with passes(device, scene, rig, grid, placed, sampling=RASTER) as opened:
        centres = set(listed(opened))
    assert centres < whole


# ---- the picture ------------------------------------------------------------------------------


def random_case(seed: int) -> tuple[Scene, Rig, ViewGrid, NDArray[np.float64]]:
    rng = np.random.default_rng(seed)
    profile, grid = random_grid(rng, DISPLAYS[rng.integers(len(DISPLAYS))])
    rig = profile.rig(int(rng.choice([1, 2, 7, 48])))
    return (
        random_scene(rng, profile, 20), rig, grid, random_camera(rng, profile.size_mm)
    )  # fmt: skip


def winners_of(device: Device, case, sampling: Sampling, **options) -> Winners:
    scene, rig, grid, placed = case
    with passes(
        device, scene, rig, grid, placed, sampling=sampling, winners="two-pass", **options
    ) as opened:
        return opened.winners()


def assert_same(found: Winners, expected: Winners) -> None:
    for field in dataclasses.fields(Winners):
        np.testing.assert_array_equal(getattr(found, field.name), getattr(expected, field.name))


@sources
@examples(6)
@given(seed=seeds)
def test_both_lattices_show_the_same(device: Device, sampling: Sampling, seed: int) -> None:
    """Bit for bit, masks, blended surfaces and what the near plane cuts included."""
    case = random_case(seed)
    expected = winners_of(device, case, Sampling())
    assert_same(winners_of(device, case, sampling), expected)
    isotropic = dataclasses.replace(sampling, density="isotropic", texture_limit=False)
    assert_same(winners_of(device, case, isotropic), expected)


@sources
def test_windows_strips_and_bands_do_not_show(
    device: Device, sampling: Sampling, monkeypatch: pytest.MonkeyPatch
) -> None:
    case = random_case(5)
    expected = winners_of(device, case, Sampling())
    grid = case[2]
    monkeypatch.setattr(cells, "MOST_WINDOW_POINTS", 500)  # its largest triangle has 353
    monkeypatch.setattr(owned, "MOST_ITERATIONS", 3 * grid.columns)
    monkeypatch.setattr(
        view_target, "BAND_BYTES", -(-grid.rows // 2) * 4 * case[1].views * grid.columns
    )
    scene, rig, _, placed = case
    with passes(device, scene, rig, grid, placed, sampling=sampling, winners="two-pass") as opened:
        assert len(opened.target.bands) == 2
        assert max(points.windows for _, points in opened.batches) > 1
        assert max(points.strips for _, points in opened.batches) > 1
        found = opened.winners()
    assert_same(found, expected)


def test_a_lost_point_shows(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """The comparisons above would see one point too few."""
    case = random_case(11)
    expected = winners_of(device, case, Sampling())
    fill = cells.SampleCells.fill

    def one_less(self, batch, points, band, window) -> None:
        fill(self, batch, points, band, window)
        record = points.work.read(dtype("CellWork")).copy()
        record["points"] = record["points"] // 2
        points.work.write(record)

    monkeypatch.setattr(cells.SampleCells, "fill", one_less)
    found = winners_of(device, case, CELLS)
    assert (found.solid != expected.solid).any()


def test_huge_triangles_have_no_more_cells_than_a_lattice_holds(device: Device) -> None:
    profile = DisplayProfile.load(PAPER)
    rig, grid = profile.rig(3), ViewGrid.upright(profile, 48, 36)
    ground = np.array([[[-1e5, -60.0, 500.0], [1e5, -60.0, 500.0], [0.0, -60.0, -1e5]]])
    scene = scene_of(mesh_of(ground), materials=(Material("both", double_sided=True),))
    case = scene, rig, grid, np.eye(4)
    with passes(device, scene, rig, grid, sampling=CELLS) as opened:
        lattice = lattice_of(scene, opened.triangles(), 0, rig, grid)
        assert max(lattice.counts) <= MOST_CELLS
        assert max(max(u, v) for _, u, v in listed(opened)) < MOST_CELLS
    expected = winners_of(device, case, Sampling())
    assert_same(winners_of(device, case, CELLS), expected)
    assert (expected.solid == 0).mean() > 0.1


# ---- what the paper has and we do not ---------------------------------------------------------


@pytest.mark.parametrize("sampling", [Sampling(), CELLS, RASTER], ids=["rows", "cells", "raster"])
def test_culling_by_vertices_loses_a_triangle_that_covers_the_window(
    device: Device, sampling: Sampling
) -> None:
    profile = DisplayProfile.load(PAPER)
    rig, grid = profile.rig(3), ViewGrid.upright(profile, 48, 36)
    covering = 10.0 * profile.size_mm[0] * np.array([[[-1.0, -1, 0], [1, -1, 0], [0, 1, 0]]])
    within = 0.01 * covering + (0.0, 0.0, 10.0)
    case = scene_of(mesh_of(covering), mesh_of(within)), rig, grid, np.eye(4)
    exact = winners_of(device, case, sampling)
    assert set(np.unique(exact.solid)) == {0, 1}
    by_vertices = dataclasses.replace(sampling, culling="vertices")
    lossy = winners_of(device, case, by_vertices)
    nothing = np.uint32(0xFFFFFFFF)
    np.testing.assert_array_equal(lossy.solid, np.where(exact.solid == 0, nothing, exact.solid))


def test_the_papers_preset_samples_as_the_paper(device: Device) -> None:
    """All of its choices at once, on a scene without what they lose."""
    profile = DisplayProfile.load(PAPER)
    rig, grid = profile.rig(7), ViewGrid.upright(profile, 48, 36)
    case = small_scene(np.random.default_rng(3), profile), rig, grid, np.eye(4)
    paper = dataclasses.replace(PAPER_SAMPLING, stochastic_culling=False)
    assert_same(winners_of(device, case, paper), winners_of(device, case, Sampling()))

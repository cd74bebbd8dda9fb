"""Culling, slices and density against the row lattice of the reference."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from lfd_render.display import DisplayProfile, Rig, ViewGrid
from lfd_render.gpu.device import Device
from lfd_render.gpu.layout import CONSTANTS
from lfd_render.passes import sample, view_target
from lfd_render.passes.sampling import Sampling
from lfd_render.reference import Triangles, points
from lfd_render.reference.culling import areas_px, kept
from lfd_render.reference.points import PointRow, cells_of, columns_of, point_rows
from lfd_render.scene import Image, Instance, Material, Scene, TextureSlot

from .helpers import (
    DISPLAYS,
    PAPER,
    examples,
    mesh_of,
    passes,
    random_camera,
    random_grid,
    random_scene,
    scene_of,
    shifted,
    soup,
)
from .rounding import EDGE_ROUNDINGS, edge_band_px

pytestmark = pytest.mark.needs("gl")

seeds = st.integers(0, 2**32 - 1)
Key = tuple[int, int]  # triangle, row


@dataclasses.dataclass(frozen=True, eq=False)
class Case:
    """The rows of points that the device wrote for a scene, and the scene as it placed it."""

    scene: Scene
    triangles: Triangles
    rig: Rig
    grid: ViewGrid
    rows: NDArray[np.void]
    lengths: NDArray[np.float32]  # of points, by row
    count: int  # points, as the device counts them

    def found(self) -> dict[Key, tuple[np.void, float]]:
        """Rows that cover something, and the length of their points."""
        covering = self.rows["a_column"] != self.rows["b_column"]
        covering |= self.rows["a_k"] != self.rows["b_k"]
        keys = zip(self.rows["triangle"].tolist(), rows_of(self.rows).tolist(), strict=True)
        values = zip(self.rows, self.lengths.tolist(), strict=True)
        return {key: value for key, value, real in zip(keys, values, covering, strict=True) if real}

    def expected(self) -> dict[Key, PointRow]:
        found = point_rows(self.scene, self.triangles, self.rig, self.grid)
        return {(row.triangle, row.row): row for row in found}

    def band_px(self, triangle: int) -> float:
        """How far an edge of a triangle may be off."""
        corners = self.triangles.p_display[triangle]
        nearest = max(self.rig.near_mm, self.rig.distance_mm - corners[:, 2].max())
        k = np.array(self.rig.distance_mm / nearest)
        return float(edge_band_px(corners, k, self.rig, self.grid)) / EDGE_ROUNDINGS


def rows_of(rows: NDArray[np.void]) -> NDArray[np.int64]:
    return (rows["row_sides"] & (CONSTANTS["DOUBLE_SIDED"] - 1)).astype(np.int64)


def random_case(device: Device, seed: int, *, count: int = 20) -> Case:
    rng = np.random.default_rng(seed)
    profile, grid = random_grid(rng, DISPLAYS[rng.integers(len(DISPLAYS))])
    rig = profile.rig(int(rng.choice([1, 2, 7, 48])))
    scene = random_scene(rng, profile, count)
    with passes(device, scene, rig, grid, random_camera(rng, profile.size_mm)) as opened:
        rows, lengths = opened.rows()
        return Case(scene, opened.triangles(), rig, grid, rows, lengths, opened.count_points())


# ---- which triangles and rows -----------------------------------------------------------------


def doubtful(case: Case, key: Key) -> bool:
    """Whether rounding may decide if a triangle has points on a row: a corner, or the cut at the
    near plane, lies on the row's centre line, or the slice just reaches the frusta."""
    triangle, row = key
    corners, band = case.triangles.p_display[triangle], 2.0 * case.band_px(triangle)
    nudged = []
    for rows in (-band, 0.0, band):
        for columns in (-band, 0.0, band):
            grid = dataclasses.replace(
                case.grid,
                panel_mm=case.grid.panel_mm,
                row_offset=case.grid.row_offset + columns,
            )
            moved = shifted(corners, 0.0, rows * grid.panel_mm[1] / grid.rows, 0.0)
            nudged.append(points.slice_mm(moved, case.rig, grid, row) is not None)
    return any(nudged) and not all(nudged)


@examples(20)
@given(seed=seeds)
def test_triangles_have_points_on_the_rows_they_reach(device: Device, seed: int) -> None:
    case = random_case(device, seed)
    expected = case.expected()
    differ = set(case.found()) ^ set(expected)
    assert wrong_rows(case, expected) == []
    assert len(differ) <= 2 + 0.01 * len(expected)


def wrong_rows(case: Case, expected: dict[Key, PointRow]) -> list[Key]:
    """Rows of points that there should not be, or that should be, and rounding does not decide."""
    found = case.found()
    differ = set(found) ^ set(expected)
    # A slice shorter than its ends are exact may come out without length, and hold no point, or
    # with one, and do: triangles without area have such slices.
    lengths = {k: abs(row["b_column"] - row["a_column"]) for k, (row, _) in found.items()}
    lengths |= {k: np.ptp(row.columns) for k, row in expected.items()}
    short = {k for k, length in lengths.items() if length <= 2.0 * case.band_px(k[0])}
    return [key for key in differ - short if not doubtful(case, key)]


def test_culling_drops_what_no_view_sees(device: Device) -> None:
    profile = DisplayProfile.load(PAPER)
    rig, grid = profile.rig(7), ViewGrid.upright(profile, 48, 36)
    facing = np.array([[-20.0, -20, 0], [20, -20, 0], [0, 20, 0]])
    row_mm = profile.size_mm[1] / 36
    hidden = {
        "turned away": facing[::-1],
        "behind the viewer": shifted(facing, 0, 0, 700),
        "above the window": shifted(facing, 0, 200, 0),
        "left of the window": shifted(facing, -400, 0, 0),
        "between two rows": shifted(facing * [1, 0.01, 1], 0, 0.5 * row_mm + 0.25, 0),
        "without area": facing * [1, 0, 1],
        "before the near plane": shifted(facing, 0, 0, profile.distance_mm - 0.5 * rig.near_mm),
    }
    for name, corners in hidden.items():
        with passes(device, scene_of(mesh_of(corners[None])), rig, grid) as opened:
            assert len(opened.rows()[0]) == 0, name
    with passes(device, scene_of(mesh_of(facing[None])), rig, grid) as opened:
        assert len(opened.rows()[0]) > 0


# ---- slices -----------------------------------------------------------------------------------


@examples(5)
@given(seed=seeds)
def test_slices_end_where_the_plane_cuts_the_triangle(device: Device, seed: int) -> None:
    case = random_case(device, seed)
    assert wrong_slices(case, case.expected()) == 0


def wrong_slices(case: Case, expected: dict[Key, PointRow]) -> int:
    """Rows whose ends appear elsewhere than the reference's in the first or the last view."""
    wrong = 0
    for key, (row, _) in case.found().items():
        if key not in expected or doubtful(case, key):
            continue
        band = case.band_px(key[0])
        for view in (0, case.rig.views - 1):
            eye = case.rig.eye_x_mm[view] / case.grid.column_mm
            columns = [row[f"{end}_column"] + (1.0 - row[f"{end}_k"]) * eye for end in "ab"]
            ends = columns_of(expected[key].ends_mm, case.rig, case.grid, key[1], view)
            wrong += not np.allclose(
                np.sort(columns), np.sort(ends), rtol=0, atol=_reach(band, ends)
            )
    return wrong


def _reach(band_px: float, ends: NDArray[np.float64]) -> float:
    """A slice nearly along its triangle's edge, or cut far outside the view, is off by more."""
    return band_px * (1.0 + float(np.abs(ends).max()))


@examples(10)
@given(seed=seeds)
def test_a_single_sided_row_runs_rightward_where_it_is_faced(device: Device, seed: int) -> None:
    case = random_case(device, seed)
    for (triangle, _), (row, _) in case.found().items():
        both = bool(row["row_sides"] & CONSTANTS["DOUBLE_SIDED"])
        assert both == case.triangles.double_sided[triangle]
        sides = points.eye_sides(case.triangles.p_display[triangle], case.rig)
        if case.triangles.mirrored[triangle]:
            sides = -sides
        eyes = case.rig.eye_x_mm / case.grid.column_mm
        length = (row["b_column"] - row["a_column"]) - (row["b_k"] - row["a_k"]) * eyes
        clear = np.abs(length) > 4.0 * case.band_px(triangle)
        if not both:
            np.testing.assert_array_equal((length > 0.0)[clear], (sides > 0.0)[clear])


# ---- density ----------------------------------------------------------------------------------


@examples(6)
@given(seed=seeds)
def test_points_are_as_long_as_the_texture_limit_says(device: Device, seed: int) -> None:
    case = random_case(device, seed)
    assert wrong_lengths(case) == 0


def wrong_lengths(case: Case) -> int:
    expected = {key: row.cell for key, row in case.expected().items()}
    # Areas of slivers and of texture triangles cancel in float32; 3e-5 measured.
    return sum(
        not np.isclose(length, expected[key], rtol=1e-3)
        for key, (_, length) in case.found().items()
        if key in expected
    )


@examples(8)
@given(seed=seeds)
def test_points_are_counted(device: Device, seed: int) -> None:
    case = random_case(device, seed)
    expected = case.expected()
    borderline = 0
    for (triangle, _), row in expected.items():
        # An end that lies within its band of a cell's boundary may touch one cell more or less.
        band = 2.0 * case.band_px(triangle) / row.cell + 2e-3 * np.abs(row.columns).max() / row.cell
        cells = row.columns / row.cell
        borderline += int((np.abs(cells - np.rint(cells)) <= band).sum())
    total = sum(row.count for row in expected.values())
    assert abs(case.count - total) <= borderline + 2 + 0.01 * total
    assert case.count > 0


@pytest.mark.parametrize(
    ("texels", "uv", "length"),
    [
        # One pixel of the window is 345.4/480 mm wide and 194.3/270 mm high: the two are alike.
        (480, 1.0, 1.0),  # a texel a pixel
        (240, 1.0, 2.0),  # a texel covers two columns and two rows
        (60, 1.0, 8.0),
        (30, 0.5, 16.0),  # at most sixteen
        (960, 1.0, 1.0),  # at least one
        (60, 2.0, 4.0),  # the texture repeats twice
    ],
)
def test_the_texture_limit_of_a_wall(device: Device, texels: int, uv: float, length: float) -> None:
    """Equations 1–3 where the answer is plain: a picture that fills the window, at its plane."""
    profile = DisplayProfile.load(PAPER)
    width, height = profile.size_mm
    rows = 480 * height / width
    corners = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5]]) * (width, height)
    wall = np.concatenate([corners, np.zeros((3, 1))], axis=1)[None]
    texcoords = np.array([[0, 0], [uv, 0], [uv, uv]])
    picture = Image("wall", np.full((round(texels * rows / 480), texels, 4), 255, np.uint8))
    material = Material("wall", base_color_texture=TextureSlot(0))
    mesh = mesh_of(wall, texcoords=np.repeat(texcoords[:, None], 2, axis=1)[None])
    scene = Scene("wall", (mesh,), (Instance("wall", 0, np.eye(4)),), (material,), (picture,))
    grid = ViewGrid.upright(profile, 480, 270)
    with passes(device, scene, profile.rig(1), grid) as opened:
        _, lengths = opened.rows()
    np.testing.assert_allclose(lengths, length, rtol=0.01)  # heights in whole texels


# ---- stochastic culling -----------------------------------------------------------------------


@pytest.mark.parametrize("seed", [0, 7])
def test_stochastic_culling_keeps_what_the_hash_says(
    device: Device, rng: np.random.Generator, seed: int
) -> None:
    profile = DisplayProfile.load(PAPER)
    rig, grid = profile.rig(3), ViewGrid.upright(profile, 64, 36)
    count = 4000
    # All cross the same row's centre line, so that nothing else culls them.
    centre = np.stack([rng.uniform(-150, 150, count), np.full(count, 2.7), np.zeros(count)], axis=1)
    size = 10.0 ** rng.uniform(-2, 1, count)
    shape = np.array([[-1.0, -1, 0], [1, -1, 0], [0, 1.5, 0]])
    corners = centre[:, None] + size[:, None, None] * shape
    scene = scene_of(mesh_of(corners))
    with passes(
        device, scene, rig, grid, sampling=Sampling(stochastic_culling=True), seed=seed
    ) as opened:
        rows, _ = opened.rows()
        triangles = opened.triangles()
    area = areas_px(triangles, rig, grid)
    expected = kept(area, seed)
    found = np.isin(np.arange(count), rows["triangle"])
    # float32 of 10·area against the hash: at most a triangle or two sit within rounding.
    assert np.count_nonzero(found != expected) <= 2
    small = area < 0.1
    assert 0.03 < found[small].mean() < 0.3
    assert found[~small].all()
    assert np.count_nonzero(found != kept(area, seed + 1)) > 100  # another seed, another choice


# ---- planted faults ---------------------------------------------------------------------------


def test_wrong_lattices_are_caught(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    cases = [random_case(device, seed) for seed in range(2)]

    def planted(name: str, fault: object) -> None:
        monkeypatch.setattr(points, name, fault)

    with monkeypatch.context():
        planted("densest_pixel_mm2", lambda corners, rig, grid: grid.column_mm**2)
        assert sum(map(wrong_lengths, cases)) > 0
    monkeypatch.undo()
    with monkeypatch.context():
        planted("most_texels", lambda scene, material, uv: 1.0)
        assert sum(map(wrong_lengths, cases)) > 0
    monkeypatch.undo()
    for case in cases:
        # A slice taken half a row lower.
        half_row_mm = 0.5 * case.grid.panel_mm[1] / case.grid.rows
        p_display = shifted(case.triangles.p_display, 0.0, half_row_mm, 0.0)
        lower = dataclasses.replace(case.triangles, p_display=p_display)
        moved = {
            (row.triangle, row.row): row
            for row in point_rows(case.scene, lower, case.rig, case.grid)
        }
        assert wrong_slices(case, moved) > 0


# ---- division of work -------------------------------------------------------------------------


@examples(3)
@given(seed=seeds)
def test_rows_do_not_depend_on_windows_or_bands(device: Device, seed: int) -> None:
    rng = np.random.default_rng(seed)
    profile = DisplayProfile.load(PAPER)
    rig, grid = profile.rig(7), ViewGrid.upright(profile, 40, 30)
    scene = scene_of(mesh_of(soup(rng, 100, profile)))

    def rows() -> NDArray[np.void]:
        with passes(device, scene, rig, grid) as opened:
            found, _ = opened.rows()
        return np.sort(found, order=["triangle", "row_sides"])

    whole = rows()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sample, "MOST_WINDOW_ITEMS", 13)
        patch.setattr(view_target, "BAND_BYTES", 7 * 4 * 7 * 40)
        divided = rows()
    assert whole.tobytes() == divided.tobytes()


def test_room_is_made_for_more_points(device: Device) -> None:
    """A frame whose points outgrow their room says so, and fits when repeated."""
    profile = DisplayProfile.load(PAPER)
    rig, grid = profile.rig(2), ViewGrid.upright(profile, 40, 30)
    wall = np.array([[[-400.0, -400, 0], [400, -400, 0], [0, 800, 0]]])
    with passes(device, scene_of(mesh_of(wall)), rig, grid) as opened:
        (batch, cloud), band = opened.batches[0], opened.target.bands[0]
        fresh = opened.sample.allocate(batch)
        opened.sample(batch, fresh, band)
        assert opened.sample.fit(fresh)
        assert fresh.window_items * fresh.windows >= 30
        opened.sample(batch, fresh, band)
        assert not opened.sample.fit(fresh)
        fresh.release()
        assert cloud.windows == 1


def test_cells_are_half_open() -> None:
    assert cells_of(np.array([0.0, 4.0]), 2.0) == (0, 2)
    assert cells_of(np.array([-0.1, 4.1]), 2.0) == (-1, 4)
    assert cells_of(np.array([2.0, 2.0]), 2.0) == (1, 1)

"""No holes, in any scene, from anywhere: depths of pictures against exact rays (`exact`).

Materials are opaque here, so that all geometry of a scene counts, and cameras stand wherever they
like, in the middle of things as well.
"""

import dataclasses
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from lfd_render.display import Camera, DisplayProfile, Rig, ViewGrid
from lfd_render.gpu.clock import StageClock
from lfd_render.gpu.device import Device
from lfd_render.gpu.layout import dtype
from lfd_render.gpu.scene_buffers import SceneBuffers
from lfd_render.passes.placement import Placement
from lfd_render.passes.sample import Sample
from lfd_render.passes.view_target import ViewTarget
from lfd_render.reference import Triangles, placed, visible
from lfd_render.reference.transform import points_by
from lfd_render.renderer import RenderOptions
from lfd_render.scene import Instance, Material, Mesh, Scene
from lfd_render.techniques import Lfdpr

from .exact import judged, nearest
from .helpers import (
    FULL,
    PAPER,
    examples,
    few_lenses,
    mesh_of,
    random_camera,
    random_grid,
    random_scene,
    soup,
)

pytestmark = pytest.mark.needs("gl")

PORTRAIT = "looking-glass-portrait-sample-a"
# What may differ in how pictures are made: options of `RenderOptions`.
VARIANTS: dict[str, dict[str, Any]] = {
    "default": {},
    "two-pass": {"splat": "two-pass"},
    "general": {"projection": "general"},
    "paper's lattice": {"lattice": "paper"},
    "paper's front end": {"lattice": "paper", "point_source": "raster"},
}


# ---- scenes -----------------------------------------------------------------------------------


def solid(scene: Scene) -> Scene:
    """The scene with nothing cut out or blended."""
    materials = tuple(dataclasses.replace(m, alpha_mode="opaque") for m in scene.materials)
    return dataclasses.replace(scene, materials=materials)


def model(assets: Path, name: str, substitute: str) -> Scene:
    """A real model, or what is built in where the folder of models is missing."""
    return Scene.load(assets / name if (assets / name).is_file() else substitute)


def nasty(rng: np.random.Generator) -> Scene:
    """In millimetres of the paper's display: all that is hard to draw (`helpers.soup`), balls of
    triangles down to a hundredth of a pixel and of slivers, one mirrored, over a ground that runs
    through the eyes."""
    profile = DisplayProfile.load(PAPER)
    width, height = profile.size_mm
    far = 100.0 * width
    low = -0.35 * height
    ground = np.array([[-far, low, far], [far, low, far], [far, low, -far], [-far, low, -far]])
    meshes = [
        mesh_of(ground[[[0, 1, 2], [0, 2, 3]]]),
        mesh_of(soup(rng, 30, profile), 1),
        bumpy_ball(90, 60, 0.25 * height),
        bumpy_ball(1200, 8, 0.15 * height),  # slivers, 0.15 mm by 12
        bumpy_ball(120, 80, 0.005 * height),
    ]
    matrices = []
    for index in (2, 2, 3, 3, 4):
        matrix = np.eye(4)
        matrix[:3, :3] *= rng.uniform(0.6, 1.3, 3) * [(-1.0) ** len(matrices), 1.0, 1.0]
        matrix[:3, 3] = rng.uniform(-0.4, 0.4, 3) * (width, height, width)
        matrices.append((index, matrix))
    instances = (
        Instance("ground", 0, np.eye(4)),
        Instance("soup", 1, np.eye(4)),
        Instance("soup, mirrored", 1, np.diag([-1.1, 0.9, 1.0, 1.0])),
        *(Instance(f"ball {i}", index, matrix) for i, (index, matrix) in enumerate(matrices)),
    )
    materials = (Material("one side"), Material("both", double_sided=True))
    return Scene("nasty", tuple(meshes), instances, materials)


def bumpy_ball(columns: int, rows: int, radius: float) -> Mesh:
    """A closed ball with waves, of columns × rows squares, its vertices shared."""
    v, u = np.mgrid[: rows + 1, :columns] / np.array([rows, columns])[:, None, None]
    turn, tilt = 2.0 * np.pi * u, np.pi * v
    out = radius * (1.0 + 0.1 * np.sin(5.0 * turn) * np.sin(tilt) ** 2)
    points = [np.sin(tilt) * np.cos(turn), np.cos(tilt), -np.sin(tilt) * np.sin(turn)]
    positions = (out * np.stack(points)).reshape(3, -1).T.astype(np.float32)
    corner = np.arange((rows + 1) * columns).reshape(rows + 1, columns)
    corner[0], corner[-1] = corner[0, 0], corner[-1, 0]  # the poles
    after = np.roll(corner, -1, axis=1)
    a, b, c, d = corner[:-1], corner[1:], after[1:], after[:-1]
    count = len(positions)
    return Mesh(
        f"ball {columns} × {rows}",
        positions,
        (positions / np.linalg.norm(positions, axis=1, keepdims=True)).astype(np.float32),
        np.zeros((count, 2, 2), np.float32),
        np.ones((count, 4), np.float32),
        np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3).astype(np.uint32),
        0,
    )


SCENES: dict[str, Callable[[Path], Scene]] = {
    "gallery": lambda _: Scene.load(f"builtin:gallery?triangles={250_000 if FULL else 30_000}"),
    "spheres": lambda _: Scene.load(f"builtin:spheres?triangles={100_000 if FULL else 10_000}"),
    "helmet": lambda assets: model(
        assets, "FlightHelmet/FlightHelmet.gltf", "builtin:chart?triangles=90000"
    ),
    "nefertiti": lambda assets: model(
        assets, "obj/nefertiti.obj", "builtin:spheres?triangles=90000"
    ),
    "nasty": lambda _: nasty(np.random.default_rng(7)),
}


def any_camera(rng: np.random.Generator, scene: Scene) -> Camera:
    """A window of any size somewhere in a scene, seen from anywhere."""
    low, high = scene.bounds()
    direction, up = rng.normal(size=3), np.array([0.0, 1.0, 0.0]) + 0.3 * rng.normal(size=3)
    height = np.linalg.norm(high - low) * 10.0 ** rng.uniform(-1.5, 0.2)
    return Camera(
        tuple(rng.uniform(low, high)), tuple(direction), tuple(up), height, rng.uniform(0.3, 1.0)
    )


def near_camera(rng: np.random.Generator, _: Scene) -> Camera:
    """A window near the one whose millimetres are the world's, turned by up to a right angle."""
    width, height = DisplayProfile.load(PAPER).size_mm
    target = rng.uniform(-0.3, 0.3, 3) * (width, height, width)
    window_height = height * 10.0 ** rng.uniform(-0.5, 0.5)
    camera = Camera(tuple(target), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), window_height)
    return camera.turned(rng.uniform(-0.5, 0.5) * np.pi).with_depth_scale(rng.uniform(0.5, 1.0))


# ---- pictures ---------------------------------------------------------------------------------


class Depths:
    """Depths of a scene before any camera, by one technique that stays."""

    def __init__(
        self, device: Device, buffers: SceneBuffers, rig: Rig, grid: ViewGrid, **options: Any
    ) -> None:
        self.rig, self.grid = rig, grid
        choice = RenderOptions(**options)
        self._technique = Lfdpr(
            device,
            buffers,
            ViewTarget(device, rig, grid, buffers.batches),
            sampling=choice.sampling,
            general=choice.projection == "general",
            winners=choice.splat,
        )
        self._clock = StageClock(device)

    def __call__(self, display_from_world: NDArray[np.float64]) -> NDArray[np.float32]:
        """[row, view, column], ∞ where there is nothing."""
        whole = False
        while not whole:
            self._technique.begin(Placement(display_from_world, (0.0, 0.0, 0.0)), self._clock)
            found = [self._band(band) for band in self._technique.target.bands]
            whole = self._technique.complete()
        return np.concatenate(found)

    def _band(self, band) -> NDArray[np.float32]:
        self._technique.render(band, self._clock)
        shape = (band.rows, self.rig.views, self.grid.columns)
        words = self._technique._views
        if words.word_stride == 2:  # depth above id
            bits = words.words.read(np.uint32, 2 * int(np.prod(shape)))[1::2]
        else:
            bits = words.depths.read(np.uint32, int(np.prod(shape)))
        return np.minimum(bits, np.uint32(0x7F800000)).view(np.float32).reshape(shape)

    def release(self) -> None:
        self._technique.release()


@contextmanager
def pictures(
    device: Device, scene: Scene, views: list[tuple[Rig, ViewGrid]], **options: Any
) -> Iterator[list[Depths]]:
    """A scene on the device and its pictures by each rig and grid."""
    buffers = SceneBuffers(device, scene)
    buffers.lighting.use("none", turn_rad=0.0, intensity=1.0)
    made = [Depths(device, buffers, rig, grid, **options) for rig, grid in views]
    try:
        yield made
    finally:
        for each in made:
            each.release()
        buffers.release()


def small_views() -> list[tuple[Rig, ViewGrid]]:
    """Upright and along lenses, of 2,700 pixels or so a view."""
    paper, lenses, portrait = (
        DisplayProfile.load(PAPER), few_lenses(PAPER, 53.3), few_lenses(PORTRAIT, 39.7)
    )  # fmt: skip
    found = [
        (paper.rig(8), ViewGrid.upright(paper, 60, 45)),
        (lenses.rig(7), ViewGrid.lens(lenses, 45)),
    ]
    if FULL:
        found += [
            (portrait.rig(6), ViewGrid.lens(portrait, 67)),
            (paper.rig(3), ViewGrid.upright(paper, 131, 61)),
        ]
    return found


def before(triangles: Triangles, matrix: NDArray[np.float64]) -> Triangles:
    """Triangles in world space seen through a camera."""
    moved = points_by(matrix, triangles.p_display.reshape(-1, 3))
    return dataclasses.replace(triangles, p_display=moved.reshape(-1, 3, 3))


def cases() -> list[tuple[str, str, int]]:
    """Scene, variant, cameras: the default by all there is, the others by fewer."""
    found = [(name, "default", 1000 if FULL else 20) for name in SCENES]
    if FULL:
        return found + [(name, v, 20) for name in SCENES for v in VARIANTS if v != "default"]
    return [*found, ("nasty", "paper's front end", 2)]


@pytest.mark.shows("0 holes over 1,000 random cameras of each scene")
@pytest.mark.parametrize(("name", "variant", "cameras"), cases())
def test_no_camera_sees_a_hole(
    device: Device,
    assets_if_any: Path,
    measured: Callable[[str, str], None],
    name: str,
    variant: str,
    cameras: int,
) -> None:
    rng = np.random.default_rng(11)
    scene = solid(SCENES[name](assets_if_any))
    world, camera_of = placed(scene, np.eye(4)), near_camera if name == "nasty" else any_camera
    holes = ghosts = 0
    covered = []
    with pictures(device, scene, small_views(), **VARIANTS[variant]) as made:
        for index in range(cameras):
            depths = made[index % len(made)]
            matrix = camera_of(rng, scene).display_from_world(depths.rig.panel_mm)
            found = judged(depths(matrix), before(world, matrix), depths.rig, depths.grid)
            holes += np.count_nonzero(found.holes)
            ghosts += np.count_nonzero(found.ghosts)
            covered.append(found.covered)
    measured(f"{name}, {variant}", f"{holes} holes, {ghosts} ghosts, {cameras} cameras")
    assert (holes, ghosts) == (0, 0)
    assert np.mean(covered) > 0.2


@pytest.mark.parametrize("name", SCENES if FULL else ["spheres"])
def test_no_camera_sees_a_hole_at_full_size(device: Device, assets_if_any: Path, name: str) -> None:
    profile = DisplayProfile.load(PAPER)
    rng = np.random.default_rng(12)
    scene = solid(SCENES[name](assets_if_any))
    world, camera_of = placed(scene, np.eye(4)), near_camera if name == "nasty" else any_camera
    views = [(profile.rig(12 if FULL else 2), ViewGrid.upright(profile, 480, 360))]
    if FULL:
        views.append((profile.rig(5), ViewGrid.lens(profile, 2160)))
    with pictures(device, scene, views) as made:
        for index in range(6 if FULL else 1):
            depths = made[index % len(made)]
            matrix = camera_of(rng, scene).display_from_world(profile.size_mm)
            found = judged(depths(matrix), before(world, matrix), depths.rig, depths.grid)
            assert np.count_nonzero(found.holes) == np.count_nonzero(found.ghosts) == 0


# ---- the judge --------------------------------------------------------------------------------


@examples(4)
@given(seed=st.integers(0, 2**32 - 1), views=st.sampled_from([1, 3, 8]))
def test_exact_rays_see_what_the_reference_sees(seed: int, views: int) -> None:
    """The quick way against its slow twin, to the bit."""
    rng = np.random.default_rng(seed)
    profile, grid = random_grid(rng, PAPER)
    scene = solid(random_scene(rng, profile, 20))
    triangles = placed(scene, random_camera(rng, profile.size_mm))
    expected, found = (f(triangles, profile.rig(views), grid) for f in (visible, nearest))
    np.testing.assert_array_equal(found.ids, expected.ids)
    np.testing.assert_array_equal(found.depths, expected.depths)


@pytest.fixture(scope="module")
def bare() -> tuple[Scene, Triangles, NDArray[np.float64]]:
    """A ball of small triangles before a ground, and a camera's matrix: nothing else in the way."""
    width, height = DisplayProfile.load(PAPER).size_mm
    wall = np.array([[-width, -height, 0], [width, -height, 0], [width, height, 0.0]]) * 3.0
    wall[:, 2] = -200.0
    meshes = (bumpy_ball(90, 60, 0.4 * height), mesh_of(wall[None]))
    instances = tuple(Instance(mesh.name, i, np.eye(4)) for i, mesh in enumerate(meshes))
    scene = Scene("bare", meshes, instances, (Material("plain"),))
    return scene, placed(scene, np.eye(4)), np.eye(4)


def without(scene: Scene, triangle: int) -> Scene:
    """A scene whose first mesh lacks one triangle."""
    mesh = scene.meshes[0]
    broken = dataclasses.replace(mesh, triangles=np.delete(mesh.triangles, triangle, axis=0))
    return dataclasses.replace(scene, meshes=(broken, *scene.meshes[1:]))


def test_a_missing_triangle_is_a_hole(
    device: Device, bare: tuple[Scene, Triangles, NDArray[np.float64]]
) -> None:
    scene, triangles, matrix = bare
    for rig, grid in small_views():
        shown = nearest(triangles, rig, grid).ids
        ids, pixels = np.unique(shown[shown < len(scene.meshes[0].triangles)], return_counts=True)
        rarest = int(ids[np.argmin(pixels)])  # one pixel of one view will do
        with pictures(device, without(scene, rarest), [(rig, grid)]) as (depths,):
            found = judged(depths(matrix), triangles, rig, grid)
        expected = shown == rarest
        assert 1 <= np.count_nonzero(found.holes) <= np.count_nonzero(expected)
        assert not np.any(found.holes & ~expected)


def test_a_missing_row_of_points_is_a_hole(
    device: Device,
    bare: tuple[Scene, Triangles, NDArray[np.float64]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of the wall, in the picture's corner, where background shows through."""
    scene, triangles, matrix = bare
    wall = len(scene.meshes[0].triangles)
    written = Sample.fill

    def one_less(self: Sample, batch, points, band, window) -> None:
        written(self, batch, points, band, window)
        count = int(points.work.read(dtype("Work"))[window]["items"])
        rows = points.rows.read(dtype("PointRow"))[:count].copy()
        at = np.flatnonzero(rows["triangle"] == wall)[:1]  # none before there is room
        rows["b_column"][at], rows["b_k"][at] = rows["a_column"][at], rows["a_k"][at]
        points.rows.write(rows)

    for rig, grid in small_views():
        for planted in (False, True):
            with monkeypatch.context() as patch:
                if planted:
                    patch.setattr(Sample, "fill", one_less)
                with pictures(device, scene, [(rig, grid)]) as (depths,):
                    found = judged(depths(matrix), triangles, rig, grid)
            assert len(np.unique(np.nonzero(found.holes)[0])) == planted
            assert not found.ghosts.any()


def test_triangles_that_should_not_be_there_are_ghosts(
    device: Device, bare: tuple[Scene, Triangles, NDArray[np.float64]]
) -> None:
    scene, triangles, matrix = bare
    rig, grid = small_views()[0]
    with pictures(device, scene, [(rig, grid)]) as (depths,):
        found = depths(matrix)
    shown = nearest(triangles, rig, grid).ids
    gone = np.unique(shown[20:24])
    others = ~np.isin(np.arange(len(triangles)), gone)
    fewer = Triangles(
        **{f.name: getattr(triangles, f.name)[others] for f in dataclasses.fields(Triangles)}
    )
    verdict = judged(found, fewer, rig, grid)
    assert verdict.ghosts.any()
    assert not np.any(verdict.ghosts & ~np.isin(shown, gone))
    assert not verdict.holes.any()


def test_a_picture_a_fiftieth_of_a_pixel_aside_is_caught(
    device: Device, bare: tuple[Scene, Triangles, NDArray[np.float64]]
) -> None:
    scene, triangles, matrix = bare
    rig, grid = small_views()[0]
    aside = dataclasses.replace(grid, row_offset=grid.row_offset + 0.02)
    with pictures(device, scene, [(rig, aside)]) as (depths,):
        verdict = judged(depths(matrix), triangles, rig, grid)
    assert verdict.holes.any() or verdict.ghosts.any()

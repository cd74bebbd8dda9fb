"""The picture as a whole: what an eye sees, how points move between views, and no holes."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from lfd_render.display import Camera, DisplayProfile, Rig, ViewGrid
from lfd_render.gpu.clock import StageClock
from lfd_render.gpu.device import Device
from lfd_render.gpu.scene_buffers import SceneBuffers
from lfd_render.panel.look import look
from lfd_render.passes.placement import Placement
from lfd_render.passes.view_target import ViewTarget
from lfd_render.quality import ssim_luma
from lfd_render.renderer import Renderer
from lfd_render.scene import Instance, Material, Mesh, Scene
from lfd_render.techniques import Lfdpr

pytestmark = pytest.mark.needs("gl")

Pixels = NDArray[np.uint8]


@pytest.fixture(scope="module")
def display() -> DisplayProfile:
    return DisplayProfile.load("gavane-2024-tilted-4k")


def millimetre_camera(display: DisplayProfile) -> Camera:
    """The camera for which world and display space are the same."""
    return Camera((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), display.size_mm[1])


def unlit_scene(
    *surfaces: tuple[NDArray[np.float64], NDArray[np.int64], tuple[float, ...]],
) -> Scene:
    """Surfaces of one colour each: positions [n, 3] in mm, triangles [m, 3], linear RGB."""
    meshes, materials = [], []
    for index, (positions, triangles, color) in enumerate(surfaces):
        count = len(positions)
        materials.append(
            Material(f"flat {index}", base_color=(*color, 1.0), unlit=True, double_sided=True)  # type: ignore[arg-type]  # a colour has three numbers
        )
        meshes.append(
            Mesh(
                f"surface {index}",
                positions.astype(np.float32),
                np.tile(np.float32([0, 0, 1]), (count, 1)),
                np.zeros((count, 2, 2), np.float32),
                np.ones((count, 4), np.float32),
                triangles.astype(np.uint32),
                index,
            )
        )
    instances = tuple(Instance(mesh.name, i, np.eye(4)) for i, mesh in enumerate(meshes))
    return Scene("test", tuple(meshes), instances, tuple(materials))


def rectangle(
    x: tuple[float, float], y: tuple[float, float], z: float
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    corners = np.array([[x[0], y[0], z], [x[1], y[0], z], [x[1], y[1], z], [x[0], y[1], z]])
    return corners, np.array([[0, 1, 2], [0, 2, 3]])


# ---- what an eye sees -------------------------------------------------------------------------


def object_box(picture: Pixels) -> tuple[slice, slice]:
    rows, columns = np.nonzero(picture.max(axis=-1) > 8)
    return slice(rows.min(), rows.max() + 1), slice(columns.min(), columns.max() + 1)


def likeness(a: Pixels, b: Pixels, box: tuple[slice, slice]) -> float:
    return ssim_luma(np.ascontiguousarray(a[box]), np.ascontiguousarray(b[box]))


@pytest.mark.shows("look of the helmet's EIA against mvr from the same eyes")
@pytest.mark.parametrize("fraction", [0.0, 0.375, -0.375])
def test_looks_show_what_rasterisation_shows(
    renderer: Renderer, display: DisplayProfile, helmet_eia: Pixels, helmet: Scene, fraction: float
) -> None:
    angle = fraction * np.degrees(display.cone_rad)
    seen = look(helmet_eia, display, np.deg2rad(angle), views=48)
    height, width = seen.shape[:2]

    def reference(degrees: float) -> Pixels:
        rig = Rig.single(display, np.deg2rad(degrees))
        (view,) = renderer.views(helmet, display, rig=rig, view_size=(480, 360), technique="mvr")
        picture = Image.fromarray(view).resize((width, height), Image.Resampling.BILINEAR)
        return np.asarray(picture)

    references = {offset: reference(angle + offset) for offset in range(-4, 5)}
    box = object_box(references[0])
    scores = {offset: likeness(seen, picture, box) for offset, picture in references.items()}
    # Measured 0.938, 0.942 and 0.947: the rest is the views' finite number, which shows as
    # coloured edges, since each channel takes its own nearest view.
    assert scores[0] >= 0.9
    best = max(scores, key=lambda offset: scores[offset])
    assert abs(best) <= np.degrees(display.cone_rad) / 48 + 0.5  # one view, to the nearest degree

    mirrored = np.ascontiguousarray(references[0][:, ::-1])
    wrong = {"mirrored": likeness(seen, mirrored, box), -3: scores[-3], 3: scores[3]}
    assert all(score < 0.85 for score in wrong.values()), wrong


@pytest.fixture(scope="module")
def helmet(assets: Path) -> Scene:
    return Scene.load(assets / "FlightHelmet" / "FlightHelmet.gltf")


@pytest.fixture(scope="module")
def helmet_eia(renderer: Renderer, display: DisplayProfile, helmet: Scene) -> Pixels:
    return renderer.render(helmet, display, views=48).pixels


def test_lfdpr_and_mvr_weave_the_same_panel(renderer: Renderer, display: DisplayProfile) -> None:
    scene = Scene.load("builtin:spheres?triangles=20000")
    ours = renderer.render(scene, display, views=12).pixels.astype(int)
    theirs = renderer.render(scene, display, views=12, technique="mvr").pixels.astype(int)
    different = np.abs(ours - theirs).max(axis=-1) > 3
    # Hardware raster snaps vertices to 1/256 px, which moves edges; 0.06 % measured.
    assert different.mean() < 2e-3
    assert ours.std() > 20  # and there is a picture


# ---- how things move from view to view --------------------------------------------------------


@pytest.mark.shows("near and far objects move as the shear identity says")
@pytest.mark.parametrize("z_mm", [-150.0, -40.0, 0.0, 60.0, 120.0])
@pytest.mark.parametrize("technique", ["lfdpr", "mvr"])
def test_objects_move_by_the_shear(
    renderer: Renderer, display: DisplayProfile, z_mm: float, technique: str
) -> None:
    width = display.size_mm[0]
    centre_mm = 12.0
    square = rectangle((centre_mm - 15, centre_mm + 15), (-20, 20), z_mm)
    scene = unlit_scene((*square, (1.0, 1.0, 1.0)))
    views = renderer.views(
        scene, display, millimetre_camera(display), 9, view_size=(480, 270), technique=technique
    )
    rig = display.rig(9)
    k = rig.distance_mm / (rig.distance_mm - z_mm)
    expected = (k * centre_mm + (1 - k) * rig.eye_x_mm) / width * 480 + 240
    lit = views[..., 0] > 128
    columns = np.arange(480) + 0.5
    found = np.array([columns[view.any(axis=0)].mean() for view in lit])
    # A centroid of whole pixels is off by half a pixel at most.
    np.testing.assert_allclose(found, expected, atol=0.5)
    moves_right = found[-1] > found[0] + 1
    assert moves_right == (z_mm < 0)  # behind the panel things follow the eye


# ---- no holes ---------------------------------------------------------------------------------


def winners(
    device: Device, scene: Scene, display: DisplayProfile, rig: Rig, grid: ViewGrid, **options: bool
) -> tuple[NDArray[np.uint32], NDArray[np.float32]]:
    """Words and depths of a frame, [row, view, column]; the camera leaves millimetres alone."""
    buffers = SceneBuffers(device, scene)
    technique = Lfdpr(device, buffers, ViewTarget(device, rig, grid, buffers.batches), **options)
    clock = StageClock(device)
    technique.begin(
        Placement(millimetre_camera(display).display_from_world(display.size_mm), (0, 0, 0)), clock
    )
    technique.warm_up(clock)
    (band,) = technique.target.bands
    technique.render(band, clock)
    assert technique.complete()
    shape = (grid.rows, rig.views, grid.columns)
    views = technique._views
    stride = views.word_stride  # depth follows the word where both are in one buffer
    words = views.words.read(np.uint32)[::stride].reshape(shape)
    bits = views.depths.read(np.uint32)[stride - 1 :: stride].reshape(shape)
    # Nothing is infinitely far, however a layout says it.
    depths = np.minimum(bits, np.uint32(0x7F800000)).view(np.float32)
    technique.release()
    buffers.release()
    return words, depths


def rings(
    centre: tuple[float, float, float],
    radii: NDArray[np.float64],
    segments: int,
    height: Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]],
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """A disc about a centre in rings of any radii, over a height field: no edge inside is open."""
    angles = np.linspace(0.0, 2 * np.pi, segments, endpoint=False)
    x = np.concatenate(([0.0], np.outer(radii, np.cos(angles)).ravel())) + centre[0]
    y = np.concatenate(([0.0], np.outer(radii, np.sin(angles)).ravel())) + centre[1]
    positions = np.stack([x, y, centre[2] + height(x, y)], axis=1)
    around = np.arange(segments)
    after = (around + 1) % segments
    fan = np.stack([np.zeros(segments, int), 1 + around, 1 + after], axis=1)
    bands = []
    for ring in range(len(radii) - 1):
        inner, outer = 1 + ring * segments, 1 + (ring + 1) * segments
        bands.append(np.stack([inner + around, outer + around, outer + after], axis=1))
        bands.append(np.stack([inner + around, outer + after, inner + after], axis=1))
    return positions, np.concatenate([fan, *bands])


@pytest.mark.shows("0 holes, triangles from 0.01 px to 100 × the window")
@pytest.mark.parametrize("general", [False, True])
@pytest.mark.parametrize("kind", ["lens", "upright"])
def test_closed_surfaces_have_no_holes(
    device: Device,
    display: DisplayProfile,
    rng: np.random.Generator,
    scaled: Callable[[int, int], int],
    kind: str,
    general: bool,
) -> None:
    views = scaled(48, 8)
    rows = scaled(360, 180)
    grid = ViewGrid.lens(display, rows) if kind == "lens" else ViewGrid.upright(display, 480, rows)
    rig = display.rig(views)
    pixel_mm = display.size_mm[0] / 480
    # Ring triangles are as large as their radius times the angle step: 0.01 px to 100 windows.
    segments = scaled(256, 96)
    sizes = np.geomspace(0.01 * pixel_mm, 100 * display.size_mm[0], scaled(400, 150))
    radii = np.unique(sizes * segments / (2 * np.pi))
    for _ in range(scaled(20, 3)):
        centre = (*rng.uniform(-60, 60, 2), rng.uniform(-60, 40))
        waves = rng.uniform(0.02, 0.08, 2)
        amplitude = rng.uniform(0.0, 8.0)
        front = rings(
            centre, radii, segments,
            lambda x, y, a=amplitude, w=waves: a * np.sin(w[0] * x) * np.cos(w[1] * y),
        )  # fmt: skip
        behind = rectangle((-1e5, 1e5), (-1e5, 1e5), -2000.0)
        scene = unlit_scene((*front, (1, 1, 1)), (*behind, (1, 0, 0)))
        words, depths = winners(device, scene, display, rig, grid, general=general)
        assert (
            np.count_nonzero(words >= len(front[1])) == 0
        )  # neither background nor what is behind
        farthest = rig.distance_mm - (centre[2] - amplitude)
        assert depths.max() <= farthest * (1 + 1e-4)


def test_a_missing_triangle_is_seen_as_a_hole(device: Device, display: DisplayProfile) -> None:
    """The planted fault of the test above."""
    front = rings((0, 0, 0), np.geomspace(0.1, 1e4, 30), 32, lambda x, _: 0 * x)
    broken = np.delete(front[1], len(front[1]) // 2, axis=0)
    behind = rectangle((-1e5, 1e5), (-1e5, 1e5), -2000.0)
    scene = unlit_scene((front[0], broken, (1, 1, 1)), (*behind, (1, 0, 0)))
    words, _ = winners(device, scene, display, display.rig(2), ViewGrid.upright(display, 480, 270))
    assert np.count_nonzero(words >= len(broken)) > 0


@pytest.mark.shows("0 holes with a ground plane running through all cameras")
@pytest.mark.parametrize(
    ("general", "reach_mm"),
    # 1e6 is 3,000 windows; at 30,000 float32 leaves 0.2 % of depth. The general projection weighs
    # vertices, whose rounding grows with the triangle sooner.
    [(False, 9e3), (False, 1e5), (False, 1e6), (True, 9e3)],
)
@pytest.mark.parametrize("tilt", [0.0, 0.05, -0.03])
def test_a_ground_that_runs_under_the_viewer_is_whole(
    device: Device,
    display: DisplayProfile,
    scaled: Callable[[int, int], int],
    tilt: float,
    general: bool,
    reach_mm: float,
) -> None:
    """Y = −40 mm + tilt·X, from far behind the panel to far behind the viewer."""
    grid = ViewGrid.upright(display, 480, 360)
    rig = display.rig(scaled(48, 6))
    corners = np.array(
        [
            [x, -40.0 + tilt * x, z]
            for x, z in np.multiply(((-1, -1), (1, -1), (1, 1), (-1, 1)), reach_mm)
        ]
    )
    ground = (corners, np.array([[0, 3, 2], [0, 2, 1]]))
    words, depths = winners(
        device, unlit_scene((*ground, (1, 1, 1))), display, rig, grid, general=general
    )
    # The ray to window point (x, y) meets Y = −40 + tilt·X at t times its way to the window,
    # where t·(y − tilt·(x − s)) = tilt·s − 40.
    s = rig.eye_x_mm[None, :, None]

    def part_of_the_way(across: float, down: float) -> NDArray[np.float64]:
        """t of each pixel's ray, moved by parts of a pixel: [row, view, column]."""
        x = ((np.arange(480) + 0.5 + across) / 480 - 0.5) * display.size_mm[0]
        y = grid.row_mm()[:, None, None] - down * display.size_mm[1] / grid.rows
        with np.errstate(divide="ignore"):
            t: NDArray[np.float64] = (tilt * s - 40.0) / (y - tilt * (x[None, None] - s))
        depth = t * rig.distance_mm
        on_ground = np.abs(s + t * (x[None, None] - s)) < reach_mm
        # The cut at the near plane is placed to float32 rounding of the triangle's own size.
        on_ground &= (t > 0) & (depth >= rig.near_mm + 1e-6 * reach_mm)
        on_ground &= rig.distance_mm - depth > -reach_mm
        return np.where(on_ground, t, np.nan)

    # A hole lies more than 1/128 px inside.
    around = [part_of_the_way(a, b) for a in (-1 / 128, 1 / 128) for b in (-1 / 128, 1 / 128)]
    seen = np.isfinite(around).all(axis=0)
    assert seen.mean() > 0.2
    assert np.count_nonzero(words[seen] > 1) == 0
    # 1e-4 is the bound of the definition of a hole; towards the horizon depth changes by more than
    # that within the 1/128 px, and within far less than that the pixel's place is rounded.
    nearest, farthest = np.min(around, axis=0), np.max(around, axis=0)
    found = depths[seen] / rig.distance_mm
    # A plane of 1e6 mm keeps 2.8e-4 (measured), from rounding of its normal.
    bound = max(1e-4, 3e-10 * reach_mm)
    assert np.all(found >= nearest[seen] * (1 - bound))
    assert np.all(found <= farthest[seen] * (1 + bound))


# ---- the two projections ----------------------------------------------------------------------


@pytest.mark.shows("shear and general matrix path are equal")
@pytest.mark.parametrize("kind", ["lens", "upright"])
def test_shear_and_general_projection_agree(
    device: Device, display: DisplayProfile, rng: np.random.Generator, kind: str
) -> None:
    grid = ViewGrid.lens(display, 180) if kind == "lens" else ViewGrid.upright(display, 240, 180)
    rig = display.rig(7)
    count = 3000
    centres = rng.uniform((-200, -120, -300), (200, 120, 570), (count, 3))
    corners = centres[:, None] + rng.normal(size=(count, 3, 3)) * rng.lognormal(0, 2, (count, 1, 1))
    soup = (corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))
    scene = unlit_scene((*soup, (1, 1, 1)))
    shear, shear_depths = winners(device, scene, display, rig, grid)
    general, general_depths = winners(device, scene, display, rig, grid, general=True)
    different = shear != general
    # Only centres within float32 rounding of an edge or of another triangle's depth may differ.
    assert different.mean() < 1e-3
    same = ~different & (shear != 0xFFFFFFFF)
    assert same.any()
    # Depth by plane against depth by weights: worst on slivers seen edge-on.
    ratio = shear_depths[same] / general_depths[same]
    assert np.quantile(np.abs(ratio - 1), 0.999) < 1e-4


def test_two_renderers_do_not_disturb_each_other(display: DisplayProfile) -> None:
    scene = Scene.load("builtin:spheres?triangles=2000")
    with Renderer() as first, Renderer() as second:
        a = first.views(scene, display, views=2, view_size=(64, 48))
        b = second.views(scene, display, views=2, view_size=(64, 48))
        np.testing.assert_array_equal(a, first.views(scene, display, views=2, view_size=(64, 48)))
    np.testing.assert_array_equal(a, b)

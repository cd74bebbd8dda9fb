"""Lights on the device, against the reference and against plain answers."""

import dataclasses
import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from lfd_render.display import Camera, DisplayProfile, Rig, ViewGrid
from lfd_render.gpu.device import Device
from lfd_render.reference import Visibility, studio
from lfd_render.reference import lights as reference_lights
from lfd_render.reference.environment import Environment as ReferenceEnvironment
from lfd_render.reference.pipeline import shade_over
from lfd_render.reference.shade import Shading
from lfd_render.renderer import Renderer
from lfd_render.scene import Instance, Light, Material, Mesh, Scene

from .helpers import PAPER, examples, mesh_of, passes

pytestmark = pytest.mark.needs("gl")

Float64 = NDArray[np.float64]
seeds = st.integers(0, 2**32 - 1)
_cone = reference_lights.cone
HALF = 2.0**-10  # a step of half floats, relative: llvmpipe cuts, others round


def views(columns: int = 48, rows: int = 27, count: int = 2) -> tuple[Rig, ViewGrid]:
    profile = DisplayProfile.load(PAPER)
    return profile.rig(count), ViewGrid.upright(profile, columns, rows)


def wall(material: Material, lights: tuple[Light, ...] = (), bend: float = 0.5) -> Scene:
    """A square over most of the window whose normals lean outward at its corners."""
    corners = np.array([[-70.0, -60, 0], [70, -60, 0], [70, 60, 0], [-70, 60, 0]])
    normals = np.concatenate([bend * corners[:, :2] / 70.0, np.ones((4, 1))], axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    order = np.array([[0, 1, 2], [0, 2, 3]])
    mesh = mesh_of(corners[order], normals=normals[order])
    return Scene("wall", (mesh,), (Instance("wall", 0, np.eye(4)),), (material,), lights=lights)


def difference(
    device: Device,
    scene: Scene,
    reference: ReferenceEnvironment = studio,
    camera: Float64 | None = None,
    **light: object,
) -> tuple[Float64, Float64]:
    """Images of the device and of the reference at what the device found visible, where anything
    is: [pixel, rgb] each."""
    rig, grid = views()
    with passes(device, scene, rig, grid, camera, **light) as opened:
        found, triangles, images = opened.winners(), opened.triangles(), opened.images()
        world_from_display = np.linalg.inv(opened.display_from_world)
    expected = np.zeros(images.shape)
    shading = Shading(scene, triangles, world_from_display, reference)
    solid = Visibility(found.solid, found.solid_depths.astype(np.float64))
    shade_over(expected, shading, solid, rig, grid)
    shown = (found.solid != 0xFFFFFFFF).swapaxes(0, 1)
    assert shown.sum() > 500
    return images[shown], expected[shown]


def off(images: Float64, expected: Float64) -> float:
    """Largest difference beyond half floats' steps, relative to light above 1."""
    error = np.abs(images - expected) - HALF * np.abs(expected)
    return float((error / np.maximum(1.0, np.abs(expected))).max())


def random_light(rng: np.random.Generator) -> Light:
    """Before the wall, within a window's size of it, turned more or less towards it."""
    kind = rng.choice(["directional", "point", "spot"])
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    axis = np.array([*rng.uniform(-0.4, 0.4, 2), 1.0])
    turn[:, 2] = axis / np.linalg.norm(axis)
    turn[:, :2] = np.linalg.svd(turn[:, 2:])[0][:, 1:]
    matrix = np.eye(4)
    matrix[:3, :3] = turn * rng.uniform(0.1, 10.0)
    matrix[:3, 3] = [*rng.uniform(-90, 90, 2), rng.uniform(20, 200)]
    outer = rng.uniform(0.1, math.pi / 2)
    return Light(
        "light",
        kind,
        matrix,
        tuple(rng.uniform(0.0, 1.0, 3)),
        rng.uniform(0.1, 3.0) * (1.0 if kind == "directional" else 1e4),
        None if rng.random() < 0.5 else rng.uniform(50.0, 300.0),
        outer * rng.uniform(0.0, 0.9),
        outer,
    )


def lamp_at(x: float, y: float, z: float, candela: float, reach: float | None = None) -> Light:
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return Light("lamp", "point", matrix, intensity=candela, range=reach)


# ---- lights -----------------------------------------------------------------------------------


# Normals are rounded by up to 1e-4 rad, which a highlight of roughness 0.3, α = 0.09, changes by up
# to 1e-4/α of itself; the largest measured over 150 scenes is 2e-4.
LIGHT_TOLERANCE = 1e-3


@examples(20)
@given(seed=seeds)
def test_random_lights(device: Device, seed: int) -> None:
    rng = np.random.default_rng(seed)
    lights = tuple(random_light(rng) for _ in range(rng.integers(1, 6)))
    material = Material(
        "lit", (*rng.uniform(0, 1, 3), 1.0), metallic=rng.random(), roughness=rng.uniform(0.3, 1)
    )
    assert off(*difference(device, wall(material, lights))) < LIGHT_TOLERANCE


def test_as_many_lights_as_there_may_be(device: Device, rng: np.random.Generator) -> None:
    lights = tuple(random_light(rng) for _ in range(256))
    scene = wall(Material("lit", metallic=0.0, roughness=0.5), lights)
    assert off(*difference(device, scene)) < LIGHT_TOLERANCE


@pytest.mark.parametrize(
    ("name", "fault"),
    [
        ("window", lambda light, distance: 1.0 / distance),
        ("window", lambda light, distance: 1.0 / distance**2),  # without the range
        ("cone", lambda light, cosine: np.sqrt(_cone(light, cosine))),
        ("cone", lambda light, cosine: _cone(light, -cosine)),
    ],
)
def test_wrong_lights_are_caught(
    device: Device, monkeypatch: pytest.MonkeyPatch, name: str, fault: Callable[..., Float64]
) -> None:
    lamp = lamp_at(10, 0, 60, 4000.0, 90.0).world_from_light
    spot = Light("spot", "spot", lamp, (1.0, 0.8, 0.6), 4000.0, 90.0, 0.1, 0.9)
    scene = wall(Material("lit", metallic=0.0, roughness=0.5), (spot,))
    assert off(*difference(device, scene)) < LIGHT_TOLERANCE
    monkeypatch.setattr(reference_lights, name, fault)
    assert off(*difference(device, scene)) > 10 * LIGHT_TOLERANCE


def test_lights_put_out_the_key_light_and_leave_the_studio(device: Device) -> None:
    material = Material("white", metallic=0.0, roughness=1.0)
    dark = Light("dark", "point", np.eye(4), intensity=0.0)
    images, expected = difference(device, wall(material, (dark,)))
    assert off(images, expected) < LIGHT_TOLERANCE
    with_key, _ = difference(device, wall(material))
    assert np.median(with_key - images) > 0.2  # the planted fault of a key light that stays
    assert images.min() > 0.1


def white_wall_under(device: Device, light: Light) -> Float64:
    """Radiance [row, column] of a flat white wall at z = 0 in a view from the middle, by the light
    alone; almost all of it diffuse, since roughness is 1."""
    rig, grid = views(49, 27, 1)
    scene = wall(Material("white", metallic=0.0, roughness=1.0), (light,), bend=0.0)
    with passes(device, scene, rig, grid, environment="none") as opened:
        return np.asarray(opened.images()[0, :, :, 0])


def test_a_lamp_before_a_wall(device: Device) -> None:
    """I·cos/(π·d²) below the lamp and beside it; the wall's sheen adds at most 4 %/4 of it."""
    image = white_wall_under(device, lamp_at(0, 0, 50, 2500.0 * math.pi))
    row, column = 13, 24
    assert 1.0 <= image[row, column] < 1.011
    profile = DisplayProfile.load(PAPER)
    beside = (np.arange(49) - 24) * profile.size_mm[0] / 49
    falls = image[row] / image[row, column]
    lit = np.abs(beside) < 65
    expected = (1.0 + (beside / 50.0) ** 2) ** -1.5
    # Away from the middle the sheen is another's; 2 % of the light at most.
    np.testing.assert_allclose(falls[lit], expected[lit], rtol=0.02)


def test_ranges_and_cones_end_light(device: Device) -> None:
    matrix = np.eye(4)
    matrix[2, 3] = 50.0
    spot = Light("spot", "spot", matrix, (1, 1, 1), 2500.0 * math.pi, None, 0.0, math.atan(0.5))
    image = white_wall_under(device, spot)
    profile = DisplayProfile.load(PAPER)
    x = (np.arange(49) - 24) * profile.size_mm[0] / 49
    y = (13 - np.arange(27)) * profile.size_mm[1] / 27
    inside = np.hypot(x, y[:, None]) < 25.0
    assert np.all(image[inside] > 0.0)
    assert np.all(image[~inside] == 0.0)
    short, long = (lamp_at(0, 0, 50, 2500.0 * math.pi, reach) for reach in (49.9, 100.0))
    assert np.all(white_wall_under(device, short) == 0.0)
    assert white_wall_under(device, long)[13, 24] == pytest.approx(1.005 * 15 / 16, rel=0.01)


def test_lamps_far_from_the_origin(device: Device) -> None:
    """A room a thousand kilometres off looks the same, to 1e6/2⁵² of its window and so to the bit
    of float32, because lights are told from the window's centre."""
    material = Material("lit", metallic=0.0, roughness=0.5)
    lamp = lamp_at(20, 10, 40, 5000.0)
    scene = wall(material, (lamp,))
    here, _ = difference(device, scene)
    away = np.eye(4)
    away[:3, 3] = [1e9, -2e9, 5e8]
    moved = Scene(
        "far",
        scene.meshes,
        (Instance("wall", 0, away),),
        scene.materials,
        lights=(Light("lamp", "point", away @ lamp.world_from_light, intensity=5000.0),),
    )
    there, _ = difference(device, moved, camera=np.linalg.inv(away))
    np.testing.assert_array_equal(here, there)


@pytest.mark.parametrize("scale", [1e-30, 1e-3, 7.0, 1e9])
def test_light_falls_with_the_files_own_unit(device: Device, scale: float) -> None:
    """A room and its lamps made larger look the same if candela grow with the square."""
    material = Material("lit", metallic=0.0, roughness=0.5)
    spot = Light(
        "spot", "spot", lamp_at(-30, 5, 60, 1.0).world_from_light, intensity=9000.0, range=200.0
    )
    scene = wall(material, (lamp_at(20, 10, 40, 5000.0, 150.0), spot))
    here, expected = difference(device, scene)
    assert off(here, expected) < LIGHT_TOLERANCE
    size = np.diag([scale, scale, scale, 1.0])
    lights = tuple(
        dataclasses.replace(
            light,
            world_from_light=size @ light.world_from_light,
            intensity=light.intensity * scale**2,
            range=light.range * scale,  # type: ignore[operator]
        )
        for light in scene.lights
    )
    instances = (Instance("wall", 0, size),)
    scaled = dataclasses.replace(scene, instances=instances, lights=lights)
    there, expected = difference(device, scaled, camera=np.linalg.inv(size))
    assert off(there, expected) < LIGHT_TOLERANCE
    np.testing.assert_allclose(here, there, atol=2 * HALF)


def test_a_lamp_that_touches_the_wall_makes_no_nan(device: Device) -> None:
    for candela in (1.0, 1e30, 1e300):
        assert np.all(np.isfinite(white_wall_under(device, lamp_at(0, 0, 0, candela))))


def test_lights_may_move_between_frames(device: Device) -> None:
    rig, grid = views(count=1)
    scene = wall(Material("lit", metallic=0.0), (lamp_at(0, 0, 20, 800.0),), bend=0.0)
    with passes(device, scene, rig, grid, environment="none") as opened:
        held = device.ledger.total
        brightest = []
        for x in (-40.0, 0.0, 40.0):
            moved = lamp_at(x, 0, 20, 1.0).world_from_light
            opened.buffers.lighting.world_from_light = moved[None]
            opened.buffers.place(opened.display_from_world)
            image = opened.images()[0, :, :, 0]
            brightest.append(
                (int(np.argmax(image[13])) + 0.5) * grid.column_mm - 0.5 * rig.panel_mm[0]
            )
            assert device.ledger.total == held
    np.testing.assert_allclose(brightest, [-40.0, 0.0, 40.0], atol=grid.column_mm)


def lit_ball(kind: str = "metal") -> Scene:
    """A ball that fills most of a window 2 high."""
    theta, phi = np.meshgrid(
        np.linspace(0, np.pi, 65), np.linspace(0, 2 * np.pi, 129), indexing="ij"
    )
    n = np.stack([np.sin(theta) * np.sin(phi), np.cos(theta), np.sin(theta) * np.cos(phi)], -1)
    n = n.reshape(-1, 3).astype(np.float32)
    a = (np.arange(64)[:, None] * 129 + np.arange(128)).ravel()
    triangles = np.concatenate(
        [np.stack([a, a + 129, a + 130], 1), np.stack([a, a + 130, a + 1], 1)]
    ).astype(np.uint32)
    count = len(n)
    ball = Mesh(
        "ball", 0.8 * n, n, np.zeros((count, 2, 2), np.float32), np.ones((count, 4), np.float32),
        triangles, 0,
    )  # fmt: skip
    metallic = 1.0 if kind == "metal" else 0.0
    material = Material(kind, metallic=metallic, roughness=0.25)
    return Scene("ball", (ball,), (Instance("ball", 0, np.eye(4)),), (material,))


WINDOW = Camera((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), 2.0)
FRONT = Camera((0.0, 0.0, 0.8), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), 2.0)


def looks(device: Device, scene: Scene, camera: Camera = WINDOW, **options: object) -> Float64:
    """Views of a scene, 0…1 [view, y, x, rgb]."""
    display = DisplayProfile.load(PAPER)
    with Renderer(device) as renderer:
        options = {"views": 5, "view_size": (96, 54), **options}
        return renderer.views(scene, display, camera, **options) / 255.0


def brightest_column(picture: Float64) -> float:
    """Mean column of a picture's brightest hundredth."""
    light = picture.sum(axis=-1)
    return float(np.argwhere(light >= np.quantile(light, 0.99))[:, 1].mean())


@pytest.mark.parametrize(
    "options", [{"shade": "shared"}, {"shade": "ray"}, {"technique": "mvr"}], ids=str
)
def test_highlights_move_between_views(device: Device, options: dict[str, str]) -> None:
    """The window touches the ball's front, so what is painted there stays; the mirrored lamp
    appears to stand behind the surface and moves along with an eye that moves to the right."""
    lamp = lamp_at(0, 2, 4, 20.0)
    paint = Material("painted", (1.0, 1.0, 1.0, 1.0), metallic=0.0, roughness=1.0)
    shifts = []
    for material in (lit_ball().materials[0], paint):
        ball = lit_ball()
        scene = Scene("ball", ball.meshes, ball.instances, (material,), lights=(lamp,))
        pictures = looks(device, scene, FRONT, environment="none", **options)
        shifts.append(np.diff([brightest_column(picture) for picture in pictures]))
    mirrored, painted = shifts
    assert np.all(mirrored > 1.0)
    assert np.all(np.abs(painted) < 0.75)  # what views share is found every half column

"""Environments on the device, against the reference and against plain answers."""

import numpy as np
import pytest

from lfd_render.display import DisplayProfile
from lfd_render.gpu import raw as gl
from lfd_render.gpu.device import Device
from lfd_render.reference import studio
from lfd_render.reference.environment import Adjusted, Darkness, Panorama
from lfd_render.renderer import Renderer
from lfd_render.scene import Environment, Instance, Material, Scene

from .helpers import PAPER, passes, prefiltered
from .test_light import (
    HALF,
    LIGHT_TOLERANCE,
    WINDOW,
    Float64,
    difference,
    lamp_at,
    lit_ball,
    looks,
    off,
    views,
    wall,
)

pytestmark = pytest.mark.needs("gl")


def directions_of(rows: int, columns: int) -> Float64:
    """What the texels of a picture show, [y, x, xyz]."""
    theta, phi = np.meshgrid(
        (np.arange(rows) + 0.5) * np.pi / rows,
        ((np.arange(columns) + 0.5) / columns - 0.5) * 2 * np.pi,
        indexing="ij",
    )
    return np.stack([np.sin(theta) * np.cos(phi), np.cos(theta), np.sin(theta) * np.sin(phi)], -1)


def smooth_picture(rng: np.random.Generator, rows: int = 64) -> Environment:
    """Light that differs by direction and channel and has no edges."""
    d = directions_of(rows, 2 * rows)
    light = 1.0 + sum(
        rng.uniform(0.1, 0.3, 3) * np.sin(rng.uniform(1, 4) * (d @ rng.normal(size=3)))[..., None]
        for _ in range(3)
    )
    return Environment("smooth", np.asarray(light, np.float32))


def even_picture(*radiance: float) -> Environment:
    return Environment("even", np.full((4, 8, 3), radiance, np.float32))


@pytest.mark.parametrize("radiance", [0.25, 1.0, 3e4])
def test_even_light_furnace(device: Device, radiance: float) -> None:
    """Even light of radiance L is L to every lobe and normal, on all levels: the map holds it to a
    step of half floats, the harmonics to the sums' rounding."""
    found = prefiltered(device, even_picture(radiance, radiance, 2.0 * radiance))
    for level in range(found.radiance.levels):
        texels = found.radiance.read(np.float16, gl.HALF_FLOAT, level)[..., :3].astype(np.float64)
        np.testing.assert_allclose(
            texels / radiance, np.broadcast_to([1, 1, 2], texels.shape), rtol=HALF
        )
    found.release()
    rng = np.random.default_rng(1)
    normals = rng.normal(size=(50, 3))
    n = np.column_stack([normals / np.linalg.norm(normals, axis=1, keepdims=True), np.ones(50)])
    diffuse = np.einsum("ni,cij,nj->nc", n, found.diffuse, n)
    np.testing.assert_allclose(diffuse / radiance, [[1, 1, 2]] * 50, rtol=1e-4)


@pytest.mark.parametrize(
    ("metallic", "roughness", "low", "high"),
    [
        # White scatters all that comes and mirrors 4 % or more besides, as under the key light:
        # glTF's fresnel_mix would take that off what is scattered.
        (0.0, 1.0, 1.01, 1.02),
        (0.0, 0.3, 1.03, 1.10),
        # A smooth metal mirrors all.
        (1.0, 0.0, 0.995, 1.005),
        # A rough one loses what would bounce between its facets more than once.
        (1.0, 1.0, 0.44, 0.46),
    ],
)
def test_white_surfaces_in_even_light(
    device: Device, metallic: float, roughness: float, low: float, high: float
) -> None:
    scene = wall(Material("white", metallic=metallic, roughness=roughness), bend=1.0)
    level = 0.5
    images, expected = difference(
        device, scene, Panorama(np.full((4, 8, 3), level)), environment=even_picture(*[level] * 3)
    )
    assert off(images, expected) < 1e-4
    assert low * level * (1 - HALF) <= images.min()
    assert images.max() <= high * level


@pytest.mark.parametrize("roughness", [0.0, 0.2, 0.45, 0.8, 1.0])
@pytest.mark.parametrize("metallic", [0.0, 1.0])
def test_pictures_light_as_their_integrals_say(
    device: Device, rng: np.random.Generator, metallic: float, roughness: float
) -> None:
    """The map against the integral itself for each pixel. Between levels the device mixes two
    lobes for one, and its samples read texels with weights of 8 bits; 0.008 measured."""
    environment = smooth_picture(rng)
    material = Material("white", (0.9, 0.6, 0.3, 1.0), metallic=metallic, roughness=roughness)
    turn, intensity = 2.0, 0.7
    reference = Adjusted(Panorama(environment.pixels), turn, intensity)
    images, expected = difference(
        device, wall(material, bend=1.5), reference,
        environment=environment, turn_rad=turn, intensity=intensity,
    )  # fmt: skip
    assert off(images, expected) < 0.012


def test_none_is_dark_and_the_studio_may_be_turned(device: Device) -> None:
    scene = wall(
        Material(
            "white", (0.8, 0.8, 0.8, 1.0), metallic=0.5, roughness=0.5, emissive=(0.1, 0.2, 0.3)
        )
    )
    images, expected = difference(device, scene, Darkness(), environment="none")
    assert off(images, expected) < HALF
    np.testing.assert_allclose(images, [[0.1, 0.2, 0.3]] * len(images), rtol=HALF)
    adjusted = difference(device, scene, Adjusted(studio, 1.0, 0.5), turn_rad=1.0, intensity=0.5)
    assert off(*adjusted) < LIGHT_TOLERANCE
    assert off(adjusted[0], difference(device, scene)[1]) > 0.1


@pytest.mark.parametrize(
    ("column", "side"), [(12, "front"), (8, "right"), (0, "left"), (None, "top")]
)
@pytest.mark.parametrize("technique", ["lfdpr", "mvr"])
def test_a_bright_spot_lights_its_side(
    device: Device, technique: str, column: int | None, side: str
) -> None:
    """Columns 0, 4, 8, 12 of 16 show −x, −z, +x, +z; a ball before the viewer is lit from there."""
    pixels = np.zeros((8, 16, 3), np.float32)
    if column is None:
        pixels[0] = 30.0
    else:
        pixels[3:5, [column, column - 1]] = 10.0  # a direction lies between two columns
    picture = looks(
        device,
        lit_ball("plastic"),
        technique=technique,
        environment=Environment("spot", pixels),
        views=1,
    )[0]
    light = picture.sum(axis=-1)
    y, x = np.mgrid[:54, :96]
    at = np.array([(light * (x - 47.5)).sum(), (light * (26.5 - y)).sum()]) / light.sum()
    expected = {"front": (0, 0), "right": (1, 0), "left": (-1, 0), "top": (0, 1)}[side]
    assert np.all(np.sign(np.round(at / 6.0)) == expected)


def test_seams_and_poles_do_not_show(device: Device, rng: np.random.Generator) -> None:
    """Neighbouring directions across the ±180° meridian, the poles and the edges of the cube's
    faces get neighbouring light: the device's lookups differ no more there than the picture's."""
    environment = smooth_picture(rng, 256)
    rig, grid = views(160, 90, 1)
    for middle in ((-1.0, 0, 0), (0, 1.0, 0), (0, -1.0, 0), (1.0, 1.0, 1.0), (0.5, 0.3, 1.0)):
        for roughness in (0.0, 0.3, 0.6):
            scene = wall(Material("mirror", metallic=1.0, roughness=roughness), bend=0.2)
            turn = turn_to(np.array(middle))
            placed = Scene("turned", scene.meshes, (Instance("wall", 0, turn),), scene.materials)
            camera = np.linalg.inv(turn)
            with passes(device, placed, rig, grid, camera, environment=environment) as opened:
                image = opened.images()[0]
            lit = image[20:70, 50:110]
            # Half floats of light below 2 step by 2⁻¹⁰, and rounding bends by up to two steps.
            bends = np.abs(np.diff(lit, 2, axis=0)).max(), np.abs(np.diff(lit, 2, axis=1)).max()
            assert max(bends) <= 6 * 2.0**-10


def turn_to(direction: Float64) -> Float64:
    """world_from_local that turns +z to a direction."""
    z = direction / np.linalg.norm(direction)
    x = np.cross([0.0, 1, 0] if abs(z[1]) < 0.9 else [1.0, 0, 0], z)
    x /= np.linalg.norm(x)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    return matrix


def test_a_sun_stays_finite_and_gives_its_light(device: Device) -> None:
    """Radiance of 1e5 and 1e12 on one texel: level 0 is cut at half floats' largest, further levels
    hold the mean of the true light, or as much of it as halves hold."""
    for radiance in (1e5, 1e12):
        pixels = np.full((64, 128, 3), 0.5, np.float32)
        pixels[20, 40] = radiance
        found = prefiltered(device, Environment("sun", pixels))
        for level in range(found.radiance.levels):
            texels = found.radiance.read(np.float16, gl.HALF_FLOAT, level)[..., :3]
            assert np.all(np.isfinite(texels))
            assert texels.min() >= 0.5 * (1 - HALF)
        if radiance == 1e5:
            # Of roughness 1 all mirrored directions are alike, so that the mean is ∫L·cos/π; texels
            # and their samples are 11° apart, which a spot of 3° shows as up to 10 % too bright.
            solid = (2 * np.pi / 128) * (np.pi / 64) * np.sin(20.5 * np.pi / 64)
            assert texels.max() == pytest.approx(0.5 + radiance * solid / np.pi, rel=0.1)
        assert np.all(np.isfinite(found.diffuse))
        found.release()
    images, _ = difference(
        device, wall(Material("mirror", roughness=0.1), bend=3.0), Darkness(),
        environment=Environment("sun", pixels),
    )  # fmt: skip
    assert np.all(np.isfinite(images))


def test_environments_are_kept_and_let_go(device: Device, rng: np.random.Generator) -> None:
    display, before = DisplayProfile.load(PAPER), device.ledger.total
    scene, environment = lit_ball(), smooth_picture(rng)
    with Renderer(device) as renderer:

        def held(chosen: str | Environment) -> int:
            renderer.views(scene, display, WINDOW, views=1, view_size=(16, 9), environment=chosen)
            return device.ledger.total

        first = held(environment)
        assert held(environment) == held("studio") == first
        assert held(smooth_picture(rng)) == first
    assert device.ledger.total == before


@pytest.mark.parametrize("environment", ["studio", "none", "picture"])
def test_both_techniques_light_alike(
    device: Device, rng: np.random.Generator, environment: str
) -> None:
    ball = lit_ball("plastic")
    lights = tuple(lamp_at(x, 2.0, 3.0, 8.0) for x in (-2.0, 2.0))
    scene = Scene("ball", ball.meshes, ball.instances, ball.materials, lights=lights)
    chosen = smooth_picture(rng) if environment == "picture" else environment
    pictures = [
        looks(device, scene, technique=technique, environment=chosen, environment_turn_rad=0.4)
        for technique in ("lfdpr", "mvr")
    ]
    # Edges of the ball may belong to the one or to the other; elsewhere attributes interpolated by
    # hardware are off by less than a level.
    unlike = np.abs(pictures[0] - pictures[1]).max(axis=-1) > 1.5 / 255
    assert unlike.mean() < 0.005

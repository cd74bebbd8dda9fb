"""Lights and environments of the reference against answers that are plain."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from lfd_render.reference import studio
from lfd_render.reference.environment import (
    Adjusted,
    Panorama,
    basis,
    direction_place,
    ggx_lobe,
    harmonics,
)
from lfd_render.reference.lights import arriving
from lfd_render.scene import Light

Float64 = NDArray[np.float64]


def light_at(place: tuple[float, float, float], kind: str = "point", **options: object) -> Light:
    matrix = np.eye(4)
    matrix[:3, 3] = place
    return Light("light", kind, matrix, **options)  # type: ignore[arg-type]


def test_light_falls_with_the_square_of_distance() -> None:
    lamp = light_at((0, 0, 5), color=(1.0, 0.5, 0.0), intensity=100.0)
    found = arriving(lamp, np.array([[0.0, 0, 4], [0, 0, 3], [0, 0, -5], [3, 0, 1]]))
    np.testing.assert_allclose(found.irradiance[:, 0], [100, 25, 1, 4])
    np.testing.assert_allclose(found.irradiance[:, 1], [50, 12.5, 0.5, 2])
    np.testing.assert_allclose(found.directions[3], [-0.6, 0, 0.8])


def test_a_surface_that_touches_a_lamp_gets_finite_light() -> None:
    found = arriving(light_at((1, 1, 1), intensity=1e9), np.ones((1, 3)))
    assert np.isfinite(found.irradiance).all()
    assert np.all(found.directions == 0)


def test_the_range_ends_light_smoothly() -> None:
    """max(0, min(1, 1 − (d/range)⁴))/d², KHR_lights_punctual."""
    lamp = light_at((0, 0, 0), range=2.0)
    distances = np.array([0.1, 1.0, 1.999, 2.0, 3.0])
    found = arriving(lamp, distances[:, None] * [0.0, 1.0, 0.0]).irradiance[:, 0]
    expected = [(1 - 0.05**4) / 0.01, 1 - 1 / 16, (1 - 0.9995**4) / 1.999**2, 0, 0]
    np.testing.assert_allclose(found, expected, atol=1e-15)


def test_spots_fade_between_their_cones() -> None:
    """The square of the share of the cosine between both cones."""
    spot = light_at((0, 0, 0), "spot", inner_cone_rad=0.2, outer_cone_rad=0.6)
    middle = math.acos(0.5 * (math.cos(0.2) + math.cos(0.6)))
    angles = np.array([0.0, 0.19, middle, 0.601, 2.0, math.pi])
    away = np.stack([np.sin(angles), np.zeros(6), -np.cos(angles)], axis=-1)
    found = arriving(spot, 3.0 * away).irradiance[:, 0]
    np.testing.assert_allclose(found, np.array([1, 1, 0.25, 0, 0, 0]) / 9, atol=1e-15)


def test_directional_light_is_the_same_everywhere() -> None:
    turn = np.eye(4)
    turn[:3, :3] = 7.0 * np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])  # −z becomes +y, scaled
    sun = Light("sun", "directional", turn, intensity=3.0, range=0.1)
    found = arriving(sun, np.array([[0.0, 0, 0], [1e6, 5, 2]]))
    np.testing.assert_allclose(found.irradiance, 3.0)
    np.testing.assert_allclose(found.directions, [[0, -1, 0]] * 2, atol=1e-15)


# ---- environments -----------------------------------------------------------------------------


def sphere(rng: np.random.Generator, count: int) -> Float64:
    points = rng.normal(size=(count, 3))
    return np.asarray(points / np.linalg.norm(points, axis=1, keepdims=True))


def test_directions_of_a_picture() -> None:
    """The Khronos glTF viewer's: +x in the middle, +z right of it, +y above."""
    directions = np.array([[1.0, 0, 0], [0, 0, 1], [0, 0, -1], [0, 1, 0], [0, -1, 0]])
    place = direction_place(directions)
    np.testing.assert_allclose(place[:3], [[0.5, 0.5], [0.75, 0.5], [0.25, 0.5]])
    np.testing.assert_allclose(place[3:, 1], [0, 1])
    assert direction_place(np.array([[-1.0, 0, 1e-9]]))[0, 0] == pytest.approx(1.0)


def test_even_light_stays_what_it_is(rng: np.random.Generator) -> None:
    """The white furnace: a picture of one radiance is that to every surface."""
    panorama = Panorama(np.full((16, 32, 3), [0.5, 1.0, 7.0]))
    directions = sphere(rng, 20)
    for roughness in (0.0, 0.3, 1.0):
        found = panorama.radiance(directions, np.full(20, roughness))
        np.testing.assert_allclose(found, [[0.5, 1.0, 7.0]] * 20)
    # The harmonics' constants are given to six digits.
    np.testing.assert_allclose(panorama.diffuse(directions), [[0.5, 1.0, 7.0]] * 20, rtol=1e-5)


def test_harmonics_are_orthonormal() -> None:
    z = (np.arange(400) + 0.5) / 200 - 1.0
    phi = (np.arange(64) + 0.5) * np.pi / 32
    z, phi = (a.ravel() for a in np.meshgrid(z, phi))
    r = np.sqrt(1 - z * z)
    y = harmonics(np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1))
    np.testing.assert_allclose(4 * np.pi * y.T @ y / len(z), np.eye(9), atol=1e-4)


def test_diffuse_light_of_gradients_is_exact(rng: np.random.Generator) -> None:
    """Light that grows linearly, 1 + a·l, gives 1 + ⅔·a·n."""
    a = np.array([0.3, -0.5, 0.2])
    rows, columns = 256, 512
    theta, phi = np.meshgrid(
        (np.arange(rows) + 0.5) * np.pi / rows,
        ((np.arange(columns) + 0.5) / columns - 0.5) * 2 * np.pi,
        indexing="ij",
    )
    l = np.stack([np.sin(theta) * np.cos(phi), np.cos(theta), np.sin(theta) * np.sin(phi)], -1)  # noqa: E741
    normals = sphere(rng, 30)
    found = Panorama(np.repeat(1 + l @ a[:, None], 3, axis=2)).diffuse(normals)[:, 0]
    np.testing.assert_allclose(found, 1 + 2 / 3 * normals @ a, atol=1e-4)


def test_lobes_widen_with_roughness() -> None:
    """A GGX half vector is within its angle θ with chance tan²θ/(α² + tan²θ)."""
    for roughness in (0.3, 0.6, 0.9):
        lobe = ggx_lobe(roughness, 100_000)
        half = lobe + np.array([0.0, 0.0, 1.0])
        half /= np.linalg.norm(half, axis=1, keepdims=True)
        tan = 0.5 * roughness**2
        share = np.count_nonzero(half[:, 2] > 1 / math.sqrt(1 + tan * tan)) / 100_000
        assert share == pytest.approx(0.25 / 1.25, abs=1e-3)
        np.testing.assert_allclose(lobe[:, :2].mean(axis=0), 0, atol=2e-3)


def test_bases_are_right_handed(rng: np.random.Generator) -> None:
    for normal in sphere(rng, 20):
        rows = basis(normal)
        np.testing.assert_allclose(rows @ rows.T, np.eye(3), atol=1e-12)
        np.testing.assert_allclose(rows[2], normal)
        assert np.linalg.det(rows) > 0


def test_a_turn_moves_light_counter_clockwise_seen_from_above() -> None:
    pixels = np.zeros((8, 16, 3))
    pixels[4, 11:13] = 1.0  # at +z, beside the middle of the right half
    panorama = Panorama(pixels)
    for turned, degrees in ((0, 0), (1, 90), (2, 180), (3, 270)):
        ring = np.array([[0.0, 0, 1], [1, 0, 0], [0, 0, -1], [-1, 0, 0]])  # from +z to +x …
        found = Adjusted(panorama, math.radians(degrees), 2.0)
        light = found.radiance(ring, np.zeros(4))[:, 0]
        assert light[turned] > 0.9
        assert np.count_nonzero(light > 0.1) == 1
        assert int(np.argmax(found.diffuse(ring)[:, 0])) == turned
    key = Adjusted(studio, math.pi).key()[0]
    np.testing.assert_allclose(key.directions, studio.KEY_DIRECTION * [-1, 1, -1], atol=1e-12)

"""Scenes made to break a renderer: layer upon layer, all on one row, dust and needles. A full run
has a million triangles of each."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from lfd_render import DisplayProfile, Renderer, Scene
from lfd_render.gpu.device import Device
from lfd_render.scene import Material

from .helpers import FULL, PAPER, mesh_of, millimetre_camera, scene_of

pytestmark = pytest.mark.needs("gl")

Corners = NDArray[np.float64]
DISPLAY = DisplayProfile.load(PAPER)
WIDTH_MM, HEIGHT_MM = DISPLAY.size_mm
COUNT = 1_000_000 if FULL else 100_000
VIEWS, ROWS = 8, 16
BLACK = np.zeros(3, np.uint8)


def on_row(corners: Corners) -> Corners:
    """In rows above the middle one's centre, brought there, whatever their depth."""
    row_mm = HEIGHT_MM / ROWS
    nearness = (DISPLAY.distance_mm - corners[..., 2]) / DISPLAY.distance_mm
    corners[..., 1] = (corners[..., 1] - 0.5) * row_mm * nearness
    corners[..., 0] *= nearness
    return corners


def layers(rng: np.random.Generator, z_mm: Corners) -> Corners:
    """Each over everything."""
    corners = np.empty((len(z_mm), 3, 3))
    corners[..., 0] = np.array([-9, 9, 0]) * WIDTH_MM
    corners[..., 1] = np.array([-9, -9, 9]) * HEIGHT_MM
    corners[..., 2] = z_mm[:, None]
    return corners


def strips(rng: np.random.Generator, z_mm: Corners) -> Corners:
    """Each all across one row of pixels, and no higher."""
    corners = layers(rng, z_mm)
    corners[..., 1] = np.array([-0.3, -0.3, 0.3])
    return on_row(corners)


def dust(rng: np.random.Generator, z_mm: Corners) -> Corners:
    """Smaller than pixels, all about one row's centre."""
    size = rng.uniform(0.05, 0.4, (len(z_mm), 1))
    corners = np.empty((len(z_mm), 3, 3))
    corners[..., 0] = rng.uniform(-0.5, 0.5, (len(z_mm), 1)) * WIDTH_MM + size * [-1, 1, 0]
    corners[..., 1] = size * [-0.5, -0.5, 0.5]
    corners[..., 2] = 0.05 * z_mm[:, None]
    return on_row(corners)


def needles(rng: np.random.Generator, z_mm: Corners) -> Corners:
    """As long as the panel, a thirtieth of a pixel wide."""
    ends = rng.uniform(-0.6, 0.6, (2, len(z_mm), 3)) * [WIDTH_MM, HEIGHT_MM, 0.0]
    ends[..., 2] = z_mm * [[1.0], [0.5]]
    width = rng.normal(scale=0.05, size=(len(z_mm), 3)) * [1.0, 1.0, 0.0]
    return np.stack([ends[0], ends[1], ends[1] + width], axis=1)


# Of the device at once, with 100,000 triangles and with a million.
MEASURED_MB = {layers: (158, 433), strips: (39, 299), dust: (48, 308), needles: (276, 552)}


def scene_with(make: Callable[..., Corners], count: int) -> tuple[Scene, Corners, Corners]:
    """The scene, its triangles' places in depth and their colours, linear and not of black."""
    rng = np.random.default_rng(11)
    z_mm = rng.permutation(np.linspace(-0.2, 0.2, count)) * DISPLAY.distance_mm
    colors = rng.uniform(0.05, 0.7, (count, 3))
    of_corners = np.ones((count, 3, 4))
    of_corners[..., :3] = colors[:, None]
    plain = Material("plain", unlit=True, double_sided=True)
    mesh = mesh_of(make(rng, z_mm), colors=of_corners)
    return scene_of(mesh, materials=(plain,)), z_mm, colors


def seen(
    device: Device, scene: Scene, make: Callable[..., Corners], size: tuple[int, int],
    **options: Any,
) -> NDArray:  # fmt: skip
    """Pictures, within bounds of memory: points are made in windows of so many, whatever their
    number, so that only triangles and vertices take ever more room."""
    before = device.ledger.total  # of other tests
    camera = millimetre_camera(DISPLAY.size_mm)
    with Renderer(device) as renderer:
        pictures = renderer.views(scene, DISPLAY, camera, views=VIEWS, view_size=size, **options)
        peak = device.ledger.peak
    assert peak - before < 1.5e6 * MEASURED_MB[make][FULL]
    return pictures


def codes(linear: Corners) -> Corners:
    """sRGB, 0 to 255."""
    return 255 * (1.055 * linear ** (1 / 2.4) - 0.055)


@pytest.mark.parametrize(("make", "shown"), [(layers, ROWS), (strips, 1)])
@pytest.mark.parametrize("technique", ["lfdpr", "exact"])
def test_the_nearest_of_all_layers_is_seen(
    device: Device, make: Callable[..., Corners], shown: int, technique: str
) -> None:
    scene, z_mm, colors = scene_with(make, COUNT)
    pictures = seen(device, scene, make, (24, ROWS), technique=technique)
    lit = pictures[(pictures != BLACK).any(axis=-1)]
    assert len(lit) == VIEWS * shown * 24
    nearest, second = np.argsort(-z_mm)[:2]
    assert np.abs(lit - codes(colors[nearest])).max() <= 1.0
    assert np.abs(lit - codes(colors[second])).max() > 1.0  # control: another layer


@pytest.mark.parametrize(
    ("make", "size", "most"),
    [
        # Hardware snaps corners to 1/256 of a pixel, a fiftieth of a grain, a tenth of a needle's
        # width: in 2 and 8 % of the pixels shown another one is nearest, of a million needles 14 %.
        (dust, (240, ROWS), 0.04),
        (needles, (240, 160), 0.2),
    ],
)
def test_what_is_smaller_than_pixels_is_as_hardware_sees_it(
    device: Device, make: Callable[..., Corners], size: tuple[int, int], most: float
) -> None:
    scene, _, _ = scene_with(make, COUNT)
    points = seen(device, scene, make, size)
    np.testing.assert_array_equal(points, seen(device, scene, make, size, technique="exact"))
    hardware = seen(device, scene, make, size, technique="mvr", mvr="multipass-deferred")
    differ = (np.abs(points.astype(int) - hardware) > 1).any(axis=-1)
    shown = (points != BLACK).any(axis=-1) | (hardware != BLACK).any(axis=-1)
    assert shown.sum() > 1000
    assert differ.sum() < most * shown.sum()
    shifted = np.roll(points, 1, axis=0).astype(int)  # control: each view as its neighbour
    assert (np.abs(shifted - hardware) > 1).any(axis=-1).sum() > 2 * most * shown.sum()

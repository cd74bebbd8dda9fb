"""Encoding of scene-linear light against the definition, level by level."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from lfd_render import Renderer, Scene
from lfd_render.gpu import raw as gl
from lfd_render.gpu.device import Device
from lfd_render.gpu.memory import TextureArray
from lfd_render.passes.encode import Encode
from lfd_render.reference import encode, encoded
from lfd_render.reference.encode import encoded_float

from .helpers import PAPER, few_lenses, fill

pytestmark = pytest.mark.needs("gl")


def encoded_by_device(
    device: Device, linear: NDArray[np.floating], exposure: float = 1.0
) -> NDArray[np.uint8]:
    """Pictures [layer, y, x, rgb] of light [layer, y, x, rgb], each layer on its own."""
    layers, height, width = linear.shape[:3]
    texture = TextureArray(device, "light", (width, height, layers), gl.RGBA16F)
    texture.parameters(gl.NEAREST, gl.NEAREST, ("clamp", "clamp"))
    fill(device, texture, linear)
    step = Encode(device, width, height)
    pictures = []
    for layer in range(layers):
        step(texture, layer, exposure)
        pictures.append(step.read().copy())
    step.release()
    texture.release()
    return np.stack(pictures)


def light(rng: np.random.Generator) -> NDArray[np.float16]:
    """Greys over all magnitudes, colours around the shoulder, edges: [layer, y, x, rgb] as held."""
    greys = np.geomspace(1e-7, 6e4, 4096)
    colours = 10.0 ** rng.uniform(-3, 3, (4096, 3))
    near = rng.uniform(0.6, 1.2, (4096, 3))
    edges = np.zeros((4096, 3))
    edges[:8] = [[0, 0, 0], [1, 1, 1], [0.76, 0.76, 0.76], [0.8, 0.8, 0.8], [0, 0.08, 0.08],
                 [0.0031308] * 3, [6e4, 0, 0], [0.04, 0.9, 0.2]]  # fmt: skip
    rows = np.stack([np.repeat(greys[:, None], 3, axis=1), colours, near, edges])
    return rows.reshape(4, 64, 64, 3).astype(np.float16)


def wrong_levels(pictures: NDArray[np.uint8], linear: NDArray[np.floating], exposure: float) -> int:
    """Values that are not the nearest level: where float32 may round the other way either will do.

    float32's power is off by a few 1e-7 of 255 levels; 2e-4 of a level measured.
    """
    level = 255.0 * encoded_float(linear, exposure)
    return int(np.count_nonzero(np.abs(pictures - level) > 0.5 + 1e-3))


@pytest.mark.parametrize("exposure", [1.0, 0.25, 3.0])
def test_levels_are_the_nearest(device: Device, rng: np.random.Generator, exposure: float) -> None:
    linear = light(rng)
    pictures = encoded_by_device(device, linear, exposure)
    assert wrong_levels(pictures, linear, exposure) == 0
    differ = np.count_nonzero(pictures != encoded(linear, exposure))
    assert differ <= 1e-3 * pictures.size
    assert len(np.unique(pictures)) > 200


def test_nothing_is_darker_than_black(device: Device) -> None:
    linear = np.array([-1.0, -65504.0, -0.0, 0.0, 65504.0, 1e-8]).repeat(3).reshape(1, 1, 6, 3)
    found = encoded_by_device(device, linear.astype(np.float16))
    np.testing.assert_array_equal(found, encoded(linear))
    assert found[0, 0, 0].max() == 0


def _power(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    """A common mistake: a plain power of 2.2."""
    return np.asarray(linear ** (1 / 2.2))


def _clipped(color: NDArray[np.float64]) -> NDArray[np.float64]:
    """The planted fault of no tone curve."""
    return color


@pytest.mark.parametrize(
    ("name", "fault"), [("srgb_from_linear", _power), ("shouldered", _clipped), ("SHOULDER", 0.7)]
)
def test_wrong_encodings_are_caught(
    device: Device,
    rng: np.random.Generator,
    monkeypatch: pytest.MonkeyPatch,
    name: str,
    fault: Callable[..., object] | float,
) -> None:
    linear = light(rng)
    pictures = encoded_by_device(device, linear)
    monkeypatch.setattr(encode, name, fault)
    assert wrong_levels(pictures, linear, 1.0) > 100


@pytest.mark.parametrize(
    "technique",
    [
        {"shade": "shared"},
        {"shade": "ray"},
        {"technique": "exact"},
        {"technique": "mvr", "mvr": "multipass-deferred"},
    ],
    ids=lambda kind: "-".join(kind.values()),
)
def test_codes_are_those_of_linear_light(device: Device, technique: dict[str, str]) -> None:
    """Pixels encoded where they are shaded, and the background beside them, as the panel image that
    is asked for in linear light has them; the exposure may change from frame to frame."""
    scene = Scene.load("builtin:spheres?triangles=4000")
    display = few_lenses(PAPER, 40.0, (240, 135))
    found = {}
    for linear in (True, False):
        with Renderer(device) as renderer:
            for exposure in (1.0, 2.5):
                eia = renderer.render(
                    scene, display, views=6, linear=linear, exposure=exposure,
                    background=(0.021, 0.37, 1.9), **technique,
                )  # fmt: skip
                found[linear, exposure] = eia.pixels
    for exposure in (1.0, 2.5):
        np.testing.assert_array_equal(found[False, exposure], found[True, exposure])
    assert (found[True, 1.0] != found[True, 2.5]).mean() > 0.5  # control

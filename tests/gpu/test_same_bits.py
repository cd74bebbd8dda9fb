"""A picture is the same to the bit whichever way it is made on a device: by any path, in any parts,
in any order of triangles, in another process, by the same seed.

`test_splat`, `test_owned` and `test_int64` hold words to that, on random scenes; these look at
whole pictures, as `Renderer` makes them.
"""

import dataclasses
import hashlib
import subprocess
import sys

import numpy as np
import pytest
from numpy.typing import NDArray

from lfd_render import DisplayProfile, Renderer, Scene
from lfd_render.gpu import scene_buffers
from lfd_render.gpu.device import Device
from lfd_render.passes import bin as bin_pass
from lfd_render.passes import cells, owned, sample, share, view_target
from lfd_render.scene import Mesh

from .helpers import FULL, PAPER, few_lenses

pytestmark = pytest.mark.needs("gl")

VIEWS = share.MANY_VIEWS  # which share what they see, by default

# Options that change how a picture is made; each is held to itself in parts and anew.
VARIANTS: dict[str, dict[str, object]] = {
    "default": {},
    "two-pass": {"splat": "two-pass"},
    "by rays": {"shade": "ray"},
    "general": {"projection": "general"},
    "paper's lattice": {"lattice": "paper"},
    "at points": {"shade": "point"},
    "paper": {"preset": "paper", "seed": 7},
}
# Of these the pictures are those of others, too.
SAME_AS = {"two-pass": "default", "paper's lattice": "by rays"}
# One limit lowered at a time, and all, until the work falls into parts.
PARTS: dict[str, list[tuple[object, str, int]]] = {
    "bands": [(view_target, "BAND_BYTES", 4 * VIEWS * 5 * 54)],
    "windows": [(sample, "MOST_WINDOW_ITEMS", 301)],
    "batches": [(scene_buffers, "BATCH_TRIANGLES", 997)],
    "batches of few vertices": [(scene_buffers, "BATCH_VERTICES", 500)],
    "dispatches": [(owned, "MOST_ITERATIONS", 60)],
    "lists of triangles": [(bin_pass, "_LANE_LOOPS", 1), (bin_pass, "GROUPS_ACROSS", 3)],
    "lists of cells": [(cells, "MOST_WINDOW_POINTS", 4001)],
    "slice tracks": [(share, "MOST_TRACKS", 3001)],
    "words for tracks": [
        (share, "_FIRST_TRACK", 0xFFFFFFFF - 16_000),
        (scene_buffers, "BATCH_TRIANGLES", 1301),
    ],
    "shared cells": [(share, "MOST_CELLS", 5003)],
    "all": [
        (view_target, "BAND_BYTES", 4 * VIEWS * 11 * 54),
        (sample, "MOST_WINDOW_ITEMS", 257),
        (scene_buffers, "BATCH_TRIANGLES", 1301),
        (cells, "MOST_WINDOW_POINTS", 5003),
        (share, "MOST_CELLS", 7001),
    ],
}


def display() -> DisplayProfile:
    """The paper's, of 53 lenses."""
    return few_lenses(PAPER, 53.3, (320, 180))


def balls() -> Scene:
    """Spheres of which every third blends and every third is cut by its alpha."""
    spheres = Scene.load("builtin:spheres?triangles=4000")
    modes = ("opaque", "blend", "mask")
    materials = tuple(
        dataclasses.replace(m, alpha_mode=modes[i % 3], base_color=(*m.base_color[:3], 0.6))
        for i, m in enumerate(spheres.materials)
    )
    return dataclasses.replace(spheres, materials=materials)


def picture(device: Device, scene: Scene, **options: object) -> NDArray[np.uint16]:
    """The bits of a panel image in linear light."""
    with Renderer(device) as renderer:
        eia = renderer.render(scene, display(), views=VIEWS, **options)  # type: ignore[arg-type]
    assert eia.pixels.std() > 20
    assert options or eia.report["shade"] == "shared"
    return eia.linear.view(np.uint16)


def digest(bits: NDArray[np.uint16]) -> str:
    return hashlib.sha256(bits.tobytes()).hexdigest()


# ---- paths and parts --------------------------------------------------------------------------


@pytest.mark.shows("bit-identical pictures by any path, in any parts")
@pytest.mark.parametrize("variant", VARIANTS)
def test_pictures_do_not_depend_on_the_division_of_work(device: Device, variant: str) -> None:
    options = VARIANTS[variant]
    whole = picture(device, balls(), **options)
    if variant in SAME_AS:
        other = VARIANTS[SAME_AS[variant]]
        np.testing.assert_array_equal(whole, picture(device, balls(), **other))
    for limits in PARTS.values() if FULL or variant == "default" else [PARTS["all"]]:
        with pytest.MonkeyPatch.context() as patch:
            for owner, name, limit in limits:
                patch.setattr(owner, name, limit)
            np.testing.assert_array_equal(whole, picture(device, balls(), **options))


def test_a_part_left_out_is_seen(device: Device) -> None:
    """The planted fault of the test above: the limits do divide, and what is not drawn shows."""
    whole = picture(device, balls())
    written = sample.Sample.fill

    def all_but_one(self: sample.Sample, batch, points, band, window) -> None:
        if window != 1:
            written(self, batch, points, band, window)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sample, "MOST_WINDOW_ITEMS", 301)
        patch.setattr(sample.Sample, "fill", all_but_one)
        assert np.any(picture(device, balls()) != whole)


# ---- order ------------------------------------------------------------------------------------


def shuffled(mesh: Mesh, rng: np.random.Generator) -> Mesh:
    """The triangles and the vertices of a mesh in another order; corners keep theirs."""
    order, places = rng.permutation(len(mesh.triangles)), rng.permutation(len(mesh.positions))
    moved = np.empty(len(places), np.uint32)
    moved[places] = np.arange(len(places), dtype=np.uint32)
    return dataclasses.replace(
        mesh,
        positions=mesh.positions[places],
        normals=mesh.normals[places],
        texcoords=mesh.texcoords[places],
        colors=mesh.colors[places],
        triangles=moved[mesh.triangles[order]],
    )


@pytest.mark.shows("bit-identical pictures in any order of triangles")
@pytest.mark.parametrize("variant", ["default", "two-pass", "general", "paper's lattice"])
def test_pictures_do_not_depend_on_the_order_of_triangles(
    device: Device, rng: np.random.Generator, variant: str
) -> None:
    """Nor of meshes and vertices; but stochastic culling, the paper's, is by the triangle's id."""
    scene = balls()
    places = rng.permutation(len(scene.instances))
    mixed = dataclasses.replace(
        scene,
        meshes=tuple(shuffled(mesh, rng) for mesh in scene.meshes),
        instances=tuple(scene.instances[i] for i in places),
    )
    options = VARIANTS[variant]
    np.testing.assert_array_equal(
        picture(device, scene, **options), picture(device, mixed, **options)
    )


# ---- another process --------------------------------------------------------------------------

CARRIED = tuple(VARIANTS) if FULL else ("default", "paper")
ELSEWHERE = """
import sys
sys.path.insert(0, sys.argv[1])
from lfd_render.gpu.device import Device
from tests.gpu import test_same_bits as here
device = Device.open("auto")
for name in here.CARRIED:
    print(here.digest(here.picture(device, here.balls(), **here.VARIANTS[name])))
device.close()
"""


@pytest.mark.shows("bit-identical pictures in another process")
def test_another_process_makes_the_same_pictures(device: Device) -> None:
    from ..conftest import REPOSITORY  # noqa: PLC0415

    command = [sys.executable, "-c", ELSEWHERE, str(REPOSITORY)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found = dict(zip(CARRIED, done.stdout.split(), strict=True))
    for name in CARRIED:
        assert found[name] == digest(picture(device, balls(), **VARIANTS[name])), name
    assert len(set(found.values())) > 1


# ---- seeds ------------------------------------------------------------------------------------


def test_the_same_seed_gives_the_same_picture(device: Device) -> None:
    """And another seed another one, where chance plays a part: in stochastic culling alone."""
    scene = Scene.load("builtin:spheres?triangles=60000")
    paper = {"preset": "paper", "view_size": (60, 45)}
    first, again, other = (
        picture(device, scene, seed=seed, **paper) for seed in (3, 3, 4)
    )  # fmt: skip
    np.testing.assert_array_equal(first, again)
    assert np.any(first != other)
    plain = [picture(device, scene, seed=seed) for seed in (3, 4)]
    np.testing.assert_array_equal(*plain)

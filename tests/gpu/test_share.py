"""Shading that views share: the picture of rays but for what lies between two places of a slice."""

import dataclasses
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from lfd_render import DisplayProfile, Renderer, Scene
from lfd_render.gpu import shaders
from lfd_render.gpu.device import Device
from lfd_render.gpu.layout import dtype
from lfd_render.gpu.memory import Buffer
from lfd_render.gpu.programs import Kernel
from lfd_render.passes import share
from lfd_render.passes.share import MOST_GROUPS
from lfd_render.scene import Light, Material

from .helpers import PAPER, few_lenses, mesh_of, millimetre_camera, scene_of, soup
from .test_same_bits import balls

pytestmark = pytest.mark.needs("gl")

VIEWS = 24
SIZE = (160, 120)


GROUPS = """layout(local_size_x = 1) in;
#include "common/frame.glsl"
#include "share/tracks.glsl"
layout(std430) writeonly restrict buffer Found { uvec2 found[]; };
void main() {
    uvec2 tracks = tracks_of(gl_WorkGroupID.y);
    uint view = gl_WorkGroupID.x, group = group_of(tracks, view);
    found[gl_WorkGroupID.y * uint(frame.views) + view] = uvec2(group, middle_of(tracks, group));
}
"""


@pytest.mark.parametrize("views", [2, 7, 48, 2048])
def test_groups_divide_views_in_order_about_their_middle(
    device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, views: int
) -> None:
    """As many groups as are asked for, and those before and from a view that sees another side."""
    folder = tmp_path / "shaders"
    shutil.copytree(shaders.data_folder("shaders"), folder)
    (folder / "groups.comp").write_text(GROUPS)
    monkeypatch.setattr(shaders, "data_folder", lambda _: folder)
    view = np.arange(views)
    counts, crossings = range(1, min(MOST_GROUPS, views) + 1), (1, views // 2, views - 1)
    words = [count - 1 << 16 for count in counts]
    words += [1 << 16 | 1 << 20 | crossing << 21 for crossing in crossings]
    expected = [view * count // views for count in counts]
    expected += [(view >= crossing).astype(int) for crossing in crossings]

    frame = np.zeros(1, dtype("Frame"))
    frame["views"] = views
    pairs = np.zeros((len(words) + len(words) % 2, 2), np.uint32)
    pairs[: len(words), 0] = words
    kernel, found = Kernel(device, "groups.comp"), Buffer(device, "test", 8 * views * len(words))
    block, tracks = Buffer.of(device, "test", frame), Buffer.of(device, "test", pairs)
    kernel.set({"FrameBlock": block, "TriangleTracks": tracks, "Found": found})
    kernel.run((views, len(words), 1))
    groups, middles = np.moveaxis(found.read(np.uint32).reshape(len(words), views, 2), 2, 0)
    np.testing.assert_array_equal(groups, expected)
    for of, middle in zip(groups, middles, strict=True):
        for group in np.unique(of):
            members = np.flatnonzero(of == group)
            # Of both sides' groups the second's middle is half a view on where that is none.
            assert set(middle[members]) <= {
                (members[0] + members[-1]) // 2, (members[0] + members[-1] + 1) // 2
            }  # fmt: skip
    for owner in (kernel, found, block, tracks):
        owner.release()


def views_of(renderer: Renderer, scene: Scene, shade: str, views: int = VIEWS) -> NDArray[np.int64]:
    display = DisplayProfile.load(PAPER)
    found = renderer.views(scene, display, views=views, view_size=SIZE, shade=shade)
    assert found.std() > 10
    return found.astype(int)


def test_every_triangle_keeps_its_own_colour(renderer: Renderer, rng: np.random.Generator) -> None:
    """Unlit triangles from far below a column to most of the window, in all attitudes, half of
    them double-sided: halves round a colour by less than a level, and nothing else changes it.
    """
    display = DisplayProfile.load(PAPER)
    corners = soup(rng, 3000, display)
    materials = tuple(
        Material(str(i), (*rng.uniform(0.05, 1, 3), 1.0), unlit=True, double_sided=bool(i % 2))
        for i in range(50)
    )
    meshes = [mesh_of(corners[i::50], i) for i in range(50)]
    scene = scene_of(*meshes, materials=materials)
    camera = millimetre_camera(display.size_mm)
    ray, shared = (
        renderer.views(scene, display, camera, views=VIEWS, view_size=SIZE, shade=shade).astype(int)
        for shade in ("ray", "shared")
    )
    assert np.abs(ray - shared).max() <= 1
    assert np.abs(ray - np.roll(shared, 1, axis=2)).max() > 100  # control: a column off


@pytest.mark.parametrize(
    ("name", "rms", "beyond"),
    [
        ("gallery", 1.5, 0.01),
        ("spheres", 0.5, 0.003),
        ("balls", 0.5, 0.003),
        ("lights", 0.7, 0.006),
    ],
)
def test_lit_textured_scenes_differ_little(
    renderer: Renderer, name: str, rms: float, beyond: float
) -> None:
    """What differs is what changes within half a column of a slice: texture edges, glints."""
    scene = {
        "gallery": lambda: Scene.load("builtin:gallery?triangles=20000"),
        "spheres": lambda: Scene.load("builtin:spheres?triangles=20000"),
        "balls": balls,
        "lights": lit_spheres,
    }[name]()
    ray, shared = (views_of(renderer, scene, shade) for shade in ("ray", "shared"))
    assert ((ray == 0).all(-1) == (shared == 0).all(-1)).all()  # the same pixels show something
    apart = np.abs(ray - shared)
    assert np.sqrt((apart**2).mean()) < rms
    assert (apart > 8).mean() < beyond
    # Control: the neighbouring view is another picture.
    other = np.abs(ray[1:] - shared[:-1])
    assert np.sqrt((other**2).mean()) > 2 * rms


@pytest.mark.parametrize("part", ["room", "cells", "tracks"])
def test_little_room_changes_no_bit(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch, part: str
) -> None:
    scene = balls()
    whole = views_of(renderer, scene, "shared", views=7)
    if part == "room":
        monkeypatch.setattr(share, "PIXELS_A_TRACK", 10**9)
        monkeypatch.setattr(share, "PIXELS_A_CELL", 10**9)
    else:
        monkeypatch.setattr(share, f"MOST_{part.upper()}", 5000)
    np.testing.assert_array_equal(views_of(renderer, scene, "shared", views=7), whole)


def test_one_view_has_nobody_to_share_with(renderer: Renderer) -> None:
    scene = Scene.load("builtin:spheres?triangles=2000")
    ray, shared = (views_of(renderer, scene, s, views=1) for s in ("ray", "shared"))
    np.testing.assert_array_equal(ray, shared)


def test_panel_images_are_those_of_rays_too(renderer: Renderer) -> None:
    display = few_lenses(PAPER, 53.3, (320, 180))
    scene = Scene.load("builtin:gallery?triangles=20000")
    ray, shared = (
        renderer.render(scene, display, views=VIEWS, shade=shade).pixels.astype(int)
        for shade in ("ray", "shared")
    )
    assert np.sqrt(((ray - shared) ** 2).mean()) < 4.0
    assert np.sqrt(((ray - np.roll(shared, 8, axis=1)) ** 2).mean()) > 10.0  # control: a lens off


def lit_spheres() -> Scene:
    """Spheres under a directional light and a lamp among them."""
    scene = Scene.load("builtin:spheres?triangles=20000")
    low, high = scene.bounds()
    extent = float(np.linalg.norm(high - low))
    place = np.eye(4)
    place[:3, 3] = 0.5 * (low + high) + (0.0, 0.3 * extent, 0.4 * extent)
    sun = Light("sun", "directional", np.eye(4), (1.0, 0.9, 0.8), 2.0)
    lamp = Light("lamp", "point", place, (0.6, 0.8, 1.0), 0.3 * extent**2)
    return dataclasses.replace(scene, lights=(sun, lamp))


def test_what_is_quicker_is_chosen(renderer: Renderer) -> None:
    """Sharing pays with many views, where there are textures to filter, or many lights."""
    display = DisplayProfile.load(PAPER)
    plain = Scene.load("builtin:car?triangles=20000")
    lights = tuple(Light(str(i), "directional", np.eye(4)) for i in range(8))
    small: dict[str, Any] = {"view_size": (48, 36), "counted": False}
    for scene, views, expected in (
        (plain, 8, "ray"),
        (dataclasses.replace(plain, lights=lights[:7]), 8, "ray"),
        (dataclasses.replace(plain, lights=lights), 8, "shared"),
        (Scene.load("builtin:gallery?triangles=1000&textures=16"), 8, "shared"),
        (Scene.load("builtin:gallery?triangles=1000&textures=16"), 7, "ray"),
    ):
        chosen = renderer.render(scene, display, views=views, **small)
        asked = renderer.render(scene, display, views=views, shade=expected, **small)
        np.testing.assert_array_equal(chosen.pixels, asked.pixels)
        assert chosen.report["shade"] == chosen.metadata["lfd:shade"] == expected
    paper = renderer.render(plain, display, views=3, lattice="paper", shade="auto", **small)
    assert paper.report["shade"] == "ray"


@pytest.mark.parametrize("shade", ["ray", "shared"])
def test_as_many_eyes_as_there_may_be(renderer: Renderer, shade: str) -> None:
    """2048 eyes: none of them is lost to another's number, as the last and all of them show."""
    display = few_lenses(PAPER, 16.0, (32, 24))
    scene = Scene.load("builtin:gallery?triangles=2000&textures=16")
    common: dict[str, Any] = {"views": 1024, "view_size": (16, 12), "supersample": (1, 2)}
    found = renderer.views(scene, display, shade=shade, **common).astype(int)
    raster = renderer.views(scene, display, technique="mvr", **common).astype(int)
    apart = np.abs(found - raster).mean(axis=(1, 2, 3))
    # Of 192 pixels a few on edges are another triangle's to hardware, a mean of 1.5 levels; sharing
    # mixes cells besides, 4.6.
    assert apart.max() < (6.0 if shade == "shared" else 2.5)
    assert np.abs(found[:512] - raster[512:]).mean() > 10.0  # control: numbers without a bit

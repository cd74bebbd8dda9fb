"""Levels of detail: every rule against the reference, which looks at every view in turn."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from lfd_render.errors import UsageError
from lfd_render.gpu.device import Device
from lfd_render.gpu.layout import CONSTANTS, LOD_RULES
from lfd_render.reference import shade, textures, visible
from lfd_render.reference.shade import Shading, opaque_at
from lfd_render.renderer import RenderOptions
from lfd_render.scene import Image, Instance, Material, Scene, TextureSlot

from .helpers import PAPER, examples, mesh_of, passes, random_camera, random_grid, random_scene
from .rounding import explain
from .test_shade import FULL_TOLERANCE, Case, case_of, noise, pbr, views, wall

pytestmark = pytest.mark.needs("gl")

seeds = st.integers(0, 2**32 - 1)
rules = pytest.mark.parametrize("rule", LOD_RULES)


def fine_scene(rng: np.random.Generator) -> Scene:
    """Triangles at any angle to the views, many edge-on to some, with pictures of any size and
    stretch, fine or coarse."""
    sizes = np.exp2(rng.integers(0, 8, (6, 2))).astype(int)
    images = tuple(noise(rng, int(w), int(h)) for w, h in sizes)
    materials, meshes, instances = [], [], []
    for index in range(len(images)):
        transform = np.eye(3)
        transform[:2] = rng.normal(size=(2, 3)) * np.exp2(rng.uniform(-2, 2))
        slot = TextureSlot(index, uv_transform=transform if rng.random() < 0.5 else None)
        both = bool(rng.random() < 0.5)
        materials.append(
            Material(str(index), unlit=True, double_sided=both, base_color_texture=slot)
        )
        corners = rng.uniform(-1.0, 1.0, (6, 3, 3)) * (150.0, 90.0, 60.0)
        corners[::2, :, 0] = corners[::2, :1, 0] + rng.uniform(-12.0, 12.0, (3, 3))  # edge-on
        texcoords = rng.uniform(-1.0, 1.0, (6, 3, 2, 2)) * np.exp2(rng.uniform(-3, 3, 2))
        meshes.append(mesh_of(corners, index, texcoords=texcoords))
        instances.append(Instance(str(index), index, np.eye(4)))
    return Scene("fine", tuple(meshes), tuple(instances), tuple(materials), images)


def random_case(device: Device, seed: int, rule: str) -> Case:
    rng = np.random.default_rng(seed)
    rig, grid = views(60, 45, int(rng.choice([1, 2, 7, 48])))
    return case_of(device, fine_scene(rng), rig, grid, lod=rule)


def share_off(case: Case) -> float:
    """Share of visible pixels that differ by more than the device's filters do.

    Its texture weights have 8 bits and so have its mip levels, in sRGB: 0.005 measured over 16
    scenes of each rule (see test_shade.texture_tolerance).
    """
    return float((case.error().max(axis=-1) > 0.008).sum() / case.solid.shown()[1].size)


# Slivers' coordinates run over more texels than float32 tells, and the number of taps jumps where
# the ratio of axes is whole; none were seen in those scenes.
MOST_OFF = 1e-3


@rules
@examples(3)
@given(seed=seeds)
def test_rules_are_the_references(device: Device, rule: str, seed: int) -> None:
    assert share_off(random_case(device, seed, rule)) < MOST_OFF


@rules
def test_all_five_maps_follow_the_rule(device: Device, rng: np.random.Generator, rule: str) -> None:
    material, images = pbr(rng, shared=False)
    case = case_of(device, wall(material, uv=4.0, turn_rad=0.8, images=images), *views(), lod=rule)
    assert case.error().max() < FULL_TOLERANCE
    assert case.solid.shown()[1].size > 500


# ---- coverage ---------------------------------------------------------------------------------


@rules
@examples(2)
@given(seed=seeds)
def test_coverage_follows_the_rule(device: Device, rule: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    profile, grid = random_grid(rng, PAPER)
    rig = profile.rig(3)
    scene = random_scene(rng, profile, 20)
    with passes(device, scene, rig, grid, random_camera(rng, profile.size_mm), lod=rule) as opened:
        found, triangles = opened.winners().solid, opened.triangles()
        inverse = np.linalg.inv(opened.display_from_world)
    shading = Shading(scene, triangles, inverse, lod=rule)
    expected = visible(triangles, rig, grid, opaque_at(shading, rig, grid))
    result = explain(found, expected, triangles, rig, grid, shading)
    assert not result.unexplained.any()


# ---- what is plain ----------------------------------------------------------------------------


def stripes(width: int, height: int, *, across: bool) -> Image:
    """Black and white, a texel each: columns that alternate, or rows."""
    y, x = np.mgrid[:height, :width]
    white = (x if across else y) % 2
    return Image("stripes", np.repeat(255 * white[..., None], 4, axis=-1).astype(np.uint8))


def seen_picture(device: Device, image: Image, texels: tuple[float, float], rule: str) -> Case:
    """A picture on a wall at the window, so many texels a view pixel across and down."""
    rig, grid = views(64, 48, 2)
    height, width = image.pixels.shape[:2]
    by = np.array([texels[0] * 64 / width, texels[1] * 48 / height])
    transform = np.diag([by[0], by[1], 1.0])
    material = Material("p", unlit=True, base_color_texture=TextureSlot(0, uv_transform=transform))
    w, h = grid.panel_mm
    corners = 0.5 * np.array([[-w, -h, 0], [w, -h, 0], [w, h, 0], [-w, h, 0]])
    uv = np.array([[0.0, 1], [1, 1], [1, 0], [0, 0]])
    order = np.array([[0, 1, 2], [0, 2, 3]])
    mesh = mesh_of(corners[order], texcoords=np.stack([uv, uv], axis=1)[order])
    scene = Scene("picture", (mesh,), (Instance("wall", 0, np.eye(4)),), (material,), (image,))
    return case_of(device, scene, rig, grid, lod=rule)


@pytest.mark.parametrize("rule", LOD_RULES[1:])
def test_a_minified_checker_is_grey(device: Device, rule: str) -> None:
    y, x = np.mgrid[:64, :64]
    checker = np.repeat(255 * ((x + y) % 2)[..., None], 4, axis=-1).astype(np.uint8)
    # From level 1 on all texels are a half of linear light, to half a level of 8-bit sRGB.
    images = seen_picture(device, Image("checker", checker), (3.0, 3.0), rule).images
    assert np.abs(images - 0.5).max() < 0.006


def test_without_levels_a_checker_stays_black_and_white(device: Device) -> None:
    y, x = np.mgrid[:64, :64]
    checker = np.repeat(255 * ((x + y) % 2)[..., None], 4, axis=-1).astype(np.uint8)
    images = seen_picture(device, Image("checker", checker), (3.0, 3.0), "none").images
    assert images.std() > 0.2


@pytest.mark.parametrize(
    ("rule", "level"),
    [("none", 0), ("area", 1), ("long-axis", 2), ("multiview", 1), ("anisotropic", 0)],
)
def test_each_rule_takes_its_level_of_a_stretched_picture(
    device: Device, rng: np.random.Generator, rule: str, level: int
) -> None:
    """4 × 1 texels a pixel: level 2 by the long axis, 1 by the area, 0 by the short axis.

    Rows of one brightness each show their level by the contrast that is left: of noise, whose rows
    are independent, a quarter of the variance a level less than half."""
    rows = rng.integers(0, 2, (48, 1)) * np.ones((1, 256), int)
    image = Image("rows", np.repeat(255 * rows[..., None], 4, axis=-1).astype(np.uint8))
    case = seen_picture(device, image, (4.0, 1.0), rule)
    chain = textures.mip_chain(image.pixels, srgb=True)
    v = (np.arange(48) + 0.5) / 48
    uv = np.column_stack([np.full(48, 0.5), v])
    expected = textures.sampled(chain, uv, np.full(48, float(level)), ("repeat", "repeat"))
    found = case.images[0, :, 32, 0]
    # Half a level of 8-bit sRGB at each of two levels; the level itself is off by 1e-5.
    assert np.abs(found - expected[:, 0]).max() < 0.012


def test_anisotropic_taps_average_along_the_long_axis_alone(device: Device) -> None:
    across = seen_picture(device, stripes(256, 64, across=True), (8.0, 1.0), "anisotropic").images
    assert np.abs(across - 0.5).max() < 0.01
    down = seen_picture(device, stripes(64, 48, across=False), (8.0, 1.0), "anisotropic").images
    assert down.std() > 0.45  # black and white, as they are


# ---- all views --------------------------------------------------------------------------------


@examples(10)
@given(seed=seeds)
def test_a_parallel_triangle_has_no_second_level(seed: int) -> None:
    """Equation 9's 0/0."""
    rng = np.random.default_rng(seed)
    areas = np.full((5, 7), rng.uniform(0.1, 10.0))
    found = textures.among_views(areas, areas[:, 0], areas[:, 0] * rng.uniform(0.5, 3.0))
    np.testing.assert_array_equal(found, np.tile([1.0, 1.0, 0.0], (5, 1)))


def test_a_splat_larger_than_a_pixel_takes_its_own_level() -> None:
    """Equation 8 by hand: footprints of 1 to 5, this view's 2."""
    areas = np.array([[1.0, 2.0, 5.0]])
    for splat, use in ((0.5, 2.0), (2.0, 2.0), (3.0, 3.0), (9.0, 5.0)):
        found = textures.among_views(areas, np.array([2.0]), np.array([splat]))
        np.testing.assert_allclose(found, [[0.5, 2.5, (use - 1.0) / 4.0]])


# ---- options ----------------------------------------------------------------------------------


def test_presets_choose_rules() -> None:
    assert RenderOptions().lod_rule == "anisotropic"
    assert RenderOptions(technique="mvr").lod_rule == "anisotropic"
    assert RenderOptions(preset="paper").lod_rule == "multiview"
    assert RenderOptions(preset="paper", technique="mvr").lod_rule == "long-axis"
    assert RenderOptions(preset="paper", lod="none").lod_rule == "none"


def test_wrong_rules_are_named() -> None:
    with pytest.raises(UsageError, match="lod 'best': unknown; use none or area or long-axis"):
        RenderOptions(lod="best")
    with pytest.raises(UsageError, match="mvr has no points that views share; use none or area"):
        RenderOptions(lod="multiview", technique="mvr")


def test_the_reference_takes_as_many_taps() -> None:
    assert CONSTANTS["MOST_ASPECT"] == textures.MOST_ASPECT


# ---- planted faults ---------------------------------------------------------------------------


def _swapped(dx: NDArray[np.float64], dy: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
    long, short, direction = _ellipses(dx, dy)
    return long, short, direction[:, ::-1]


def _steps_as_axes(
    dx: NDArray[np.float64], dy: NDArray[np.float64]
) -> tuple[NDArray[np.float64], ...]:
    """The longer step for the long axis, as if dx and dy were square to each other."""
    a, b = np.linalg.norm(dx, axis=1), np.linalg.norm(dy, axis=1)
    longer = np.where((a > b)[:, None], dx, dy)
    direction = longer / np.maximum(np.linalg.norm(longer, axis=1, keepdims=True), 1e-300)
    return np.maximum(a, b), np.minimum(a, b), direction


def _no_splat(areas: NDArray, own: NDArray, splat: NDArray) -> NDArray[np.float64]:
    return _among_views(areas, own, 1e-9 * splat)


def _two_views(areas: NDArray, own: NDArray, splat: NDArray) -> NDArray[np.float64]:
    """The extreme eyes alone, whether or not they see that side."""
    return _among_views(areas[:, [0, -1]], own, splat)


_ellipses, _among_views = textures.ellipses, textures.among_views


@pytest.mark.parametrize(
    ("rule", "owner", "name", "fault"),
    [
        ("anisotropic", textures, "ellipses", _swapped),
        ("anisotropic", textures, "ellipses", _steps_as_axes),
        ("long-axis", textures, "long_axis_lod", textures.area_lod),
        ("multiview", shade, "among_views", _no_splat),
        ("multiview", shade, "among_views", _two_views),
    ],
)
def test_wrong_rules_are_caught(
    device: Device,
    monkeypatch: pytest.MonkeyPatch,
    rule: str,
    owner: object,
    name: str,
    fault: Callable[..., object],
) -> None:
    case = random_case(device, 3, rule)
    assert share_off(case) < MOST_OFF
    monkeypatch.setattr(owner, name, fault)
    assert share_off(case) > 10.0 * MOST_OFF

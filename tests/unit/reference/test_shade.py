"""Hits, derivatives, textures, normal maps and lights of the reference."""

import dataclasses

import numpy as np
import pytest
from numpy.typing import NDArray

from lfd_render.display import Rig, ViewGrid
from lfd_render.reference import Pixels, studio
from lfd_render.reference.shade import (
    Shading,
    Surface,
    environment_brdf,
    opaque_at,
    points_at,
    specular_brdf,
)
from lfd_render.reference.textures import (
    area_lod,
    linear_from_srgb,
    mip_chain,
    sampled,
    wrapped,
)
from lfd_render.reference.transform import Triangles, normals_by, unit
from lfd_render.scene import Image, Material, Scene, TextureSlot

from .scenes import DISTANCE_MM, mesh_of, placed, scene_of, square, views

Float64 = NDArray[np.float64]


# ---- hits -------------------------------------------------------------------------------------


def slanted() -> tuple[Scene, Triangles]:
    corners = np.array([[[-60.0, -50, -80], [70, -40, 60], [10, 60, 20]]])
    texcoords = np.array([[[0.1, 0.9], [1.3, 0.7], [0.6, -0.2]]])
    scene = scene_of(mesh_of(corners, texcoords=texcoords))
    return scene, placed(scene, np.eye(4))


def some_pixels(rig: Rig) -> tuple[NDArray[np.int64], Pixels]:
    row, view, column = np.meshgrid([13, 16, 18], range(rig.views), [29, 32, 33], indexing="ij")
    return np.zeros(row.size, int), Pixels(row.ravel(), view.ravel(), column.ravel())


def test_hits_lie_on_the_ray_and_the_triangle() -> None:
    rig, grid = views()
    _, triangles = slanted()
    ids, pixels = some_pixels(rig)
    points = points_at(triangles, rig, grid, ids, pixels)
    np.testing.assert_allclose(points.weights.sum(axis=1), 1.0)
    assert points.weights.min() > 0
    k = DISTANCE_MM / (DISTANCE_MM - points.p_display[:, 2])
    x = k * points.p_display[:, 0] + (1 - k) * rig.eye_x_mm[pixels.view]
    np.testing.assert_allclose(x, (pixels.column + 0.5) * grid.column_mm - 128)
    np.testing.assert_allclose(k * points.p_display[:, 1], grid.row_mm()[pixels.row])
    assert not points.back.any()


def test_derivatives_are_those_of_neighbouring_hits() -> None:
    """Against hits a thousandth of a column and a row aside."""
    rig, grid = views()
    _, triangles = slanted()
    ids, pixels = some_pixels(rig)
    points = points_at(triangles, rig, grid, ids, pixels)
    step = 1e-3

    def aside(columns: float, rows: float) -> Float64:
        height = grid.panel_mm[1] / grid.rows
        moved = ViewGrid(**{**vars(grid), "row_offset": grid.row_offset - columns})
        # A step downward is the same as the triangle's picture a step higher, at the same depths.
        k = DISTANCE_MM / (DISTANCE_MM - triangles.p_display[..., 2:])
        sheared = triangles.p_display.copy()
        sheared[..., 1:2] += rows * height / k
        return points_at(
            dataclasses.replace(triangles, p_display=sheared), rig, moved, ids, pixels
        ).weights

    dx = (aside(step, 0) - aside(-step, 0)) / (2 * step)
    dy = (aside(0, step) - aside(0, -step)) / (2 * step)
    np.testing.assert_allclose(points.weights_dx, dx, rtol=1e-5, atol=1e-9)
    np.testing.assert_allclose(points.weights_dy, dy, rtol=1e-5, atol=1e-9)
    np.testing.assert_allclose(
        points.p_display_dx, np.einsum("nc,cx->nx", dx, triangles.p_display[0]), rtol=1e-4
    )


# ---- textures ---------------------------------------------------------------------------------


def test_srgb_decoding() -> None:
    values = linear_from_srgb(np.array([0.0, 0.04045, 0.5, 1.0]))
    np.testing.assert_allclose(values, [0.0, 0.0031308, 0.21404114, 1.0], rtol=1e-5)


@pytest.mark.parametrize("size", [(8, 8), (16, 4), (1, 1), (5, 3), (1, 6)])
def test_levels_keep_the_mean(rng: np.random.Generator, size: tuple[int, int]) -> None:
    pixels = rng.integers(0, 256, (*size, 4)).astype(np.uint8)
    levels = mip_chain(pixels, srgb=True)
    assert levels[-1].shape == (1, 1, 4)
    assert len(levels) == max(size).bit_length()
    for level in levels:
        np.testing.assert_allclose(level.mean(axis=(0, 1)), levels[0].mean(axis=(0, 1)))


def test_levels_average_light_and_not_its_encoding() -> None:
    checker = np.zeros((2, 2, 4), np.uint8)
    checker[0, 0] = checker[1, 1] = 255
    assert mip_chain(checker, srgb=True)[1][0, 0, 0] == pytest.approx(0.5)
    grey = np.full((2, 2, 4), 128, np.uint8)
    assert mip_chain(grey, srgb=True)[1][0, 0, 0] == pytest.approx(0.2158605)
    assert mip_chain(grey, srgb=True)[1][0, 0, 3] == pytest.approx(128 / 255)
    assert mip_chain(grey, srgb=False)[1][0, 0, 0] == pytest.approx(128 / 255)


def test_texels_lie_at_their_centres_and_rows_run_down() -> None:
    level = np.arange(24.0).reshape(2, 3, 4)
    uv = (np.indices((2, 3))[::-1].reshape(2, 6).T + 0.5) / (3, 2)
    found = sampled([level], uv, np.zeros(6), ("repeat", "repeat"))
    np.testing.assert_allclose(found, level.reshape(6, 4))
    between = sampled([level], np.array([[1 / 3, 0.25]]), np.zeros(1), ("repeat", "repeat"))
    np.testing.assert_allclose(between, (level[0, 0] + level[0, 1])[None] / 2)


def test_levels_are_mixed_and_held_at_both_ends() -> None:
    levels = [np.full((4, 4, 4), 1.0), np.full((2, 2, 4), 2.0), np.full((1, 1, 4), 4.0)]
    lod = np.array([-3.0, 0.0, 0.25, 1.0, 1.5, 2.0, 9.0])
    found = sampled(levels, np.full((7, 2), 0.3), lod, ("repeat", "repeat"))[:, 0]
    np.testing.assert_allclose(found, [1, 1, 1.25, 2, 3, 4, 4])


@pytest.mark.parametrize(
    ("wrap", "expected"),
    [("repeat", [1, 2, 0, 1, 2, 0, 1]), ("clamp", [0, 0, 0, 1, 2, 2, 2]),
     ("mirror", [1, 0, 0, 1, 2, 2, 1])],
)  # fmt: skip
def test_wraps(wrap: str, expected: list[int]) -> None:
    np.testing.assert_array_equal(wrapped(np.arange(-2, 5), 3, wrap), expected)


def test_the_level_of_detail_counts_texels_of_a_pixel() -> None:
    dx, dy = np.array([[0.5, 0.0]]), np.array([[0.0, 0.25]])
    np.testing.assert_allclose(
        area_lod(dx * (16, 8), dy * (16, 8)), 2.0
    )  # 8 × 2 texels: 4², so level 2
    np.testing.assert_allclose(area_lod(dx * (32, 16), dy * (32, 16)), 3.0)
    assert area_lod(dx * (16, 8), dx * (16, 8)) < -15  # no area, no blur


# ---- surfaces ---------------------------------------------------------------------------------


def surface(material: Material, *pictures: NDArray[np.uint8], turn: bool = False) -> Surface:
    """A wall with u to the right and v down, seen from the middle; `turn`: from behind."""
    rig, grid = views(eyes=(0.0,))
    corners = square(200.0, 0.0)
    texcoords = np.stack([corners[..., 0] / 200 + 0.5, 0.5 - corners[..., 1] / 200], axis=-1)
    order = slice(None, None, -1) if turn else slice(None)
    scene = scene_of(
        mesh_of(corners[:, order], texcoords=texcoords[:, order]),
        materials=(material,),
        images=tuple(Image("picture", picture) for picture in pictures),
    )
    triangles = placed(scene, np.eye(4))
    shading = Shading(scene, triangles, np.eye(4))
    pixels = Pixels(np.array([12]), np.array([0]), np.array([30]))
    shown = np.array([0 if turn else 1])
    return Surface(shading, material, points_at(triangles, rig, grid, shown, pixels))


def flat(*color: int) -> NDArray[np.uint8]:
    return np.full((4, 4, 4), (*color, 255)[:4], np.uint8)


@pytest.mark.parametrize(
    ("color", "direction"),
    [
        ((128, 128, 255), (0, 0, 1)),
        ((255, 128, 128), (1, 0, 0)),  # red leans toward +u
        ((128, 255, 128), (0, 1, 0)),  # green against v, which runs down
        ((0, 128, 128), (-1, 0, 0)),
    ],
)
def test_normal_maps_lean_as_gltf_says(
    color: tuple[int, int, int], direction: tuple[int, int, int]
) -> None:
    material = Material("m", normal_texture=TextureSlot(0))
    found = surface(material, flat(*color)).normal[0]
    np.testing.assert_allclose(found, direction, atol=0.01)  # 128 is not quite the middle
    if direction[2] == 1:
        return
    # The planted fault: a map the other way round would be found.
    with pytest.raises(AssertionError):
        np.testing.assert_allclose(-found, direction, atol=0.01)


def test_the_scale_flattens_a_normal_map() -> None:
    steep = surface(Material("m", normal_texture=TextureSlot(0)), flat(255, 128, 255)).normal[0]
    material = Material("m", normal_texture=TextureSlot(0, scale=0.5))
    gentle = surface(material, flat(255, 128, 255)).normal[0]
    assert steep[0] / steep[2] == pytest.approx(1.0, abs=0.01)
    assert gentle[0] / gentle[2] == pytest.approx(0.5, abs=0.01)


def test_a_back_side_turns_its_normal() -> None:
    material = Material("m", double_sided=True)
    np.testing.assert_allclose(surface(material).normal[0], (0, 0, 1))
    np.testing.assert_allclose(surface(material, turn=True).normal[0], (0, 0, -1))


def test_maps_multiply_factors() -> None:
    material = Material(
        "m", (0.5, 1.0, 1.0, 0.8), metallic=0.5, roughness=0.6, emissive=(2.0, 0.0, 1.0),
        base_color_texture=TextureSlot(0), metallic_roughness_texture=TextureSlot(1),
        occlusion_texture=TextureSlot(1, scale=0.5), emissive_texture=TextureSlot(0),
    )  # fmt: skip
    found = surface(material, flat(255, 188, 0), flat(51, 102, 204))
    np.testing.assert_allclose(found.base_color[0], [0.5, 0.5029, 0.0, 0.8], atol=1e-3)
    metallic, roughness = found.metallic_roughness
    assert metallic[0] == pytest.approx(0.5 * 0.8)
    assert roughness[0] == pytest.approx(0.6 * 0.4)
    assert found.occlusion[0] == pytest.approx(1 + 0.5 * (0.2 - 1))
    np.testing.assert_allclose(found.emitted[0], [2.0, 0.0, 0.0], atol=1e-3)


def test_unlit_materials_show_their_colour() -> None:
    found = surface(Material("m", (0.2, 0.4, 0.6, 1.0), unlit=True, emissive=(1, 1, 1)))
    np.testing.assert_allclose(found.radiance(np.array([[0.0, 0, DISTANCE_MM]])), [[0.2, 0.4, 0.6]])


def test_a_mask_cuts_at_its_cutoff() -> None:
    rig, grid = views(eyes=(0.0,))
    half = np.zeros((2, 2, 4), np.uint8)
    half[:, 1, 3] = 255
    slot = TextureSlot(0, wrap=("clamp", "clamp"))
    material = Material("m", alpha_mode="mask", alpha_cutoff=0.5, base_color_texture=slot)
    corners = square(256.0, 0.0)
    texcoords = corners[..., :2] / 256 + 0.5
    scene = scene_of(
        mesh_of(corners, texcoords=texcoords),
        materials=(material,),
        images=(Image("half", half),),
    )
    shading = Shading(scene, placed(scene, np.eye(4)), np.eye(4))
    column = np.arange(64)
    pixels = Pixels(np.full(64, 16), np.zeros(64, int), column)
    # Alpha rises from 0 to 1 about the middle, where it is ½.
    np.testing.assert_array_equal(opaque_at(shading, rig, grid)(0, pixels), column >= 32)


# ---- light ------------------------------------------------------------------------------------


def sphere(rng: np.random.Generator, count: int = 400_000) -> Float64:
    return unit(rng.normal(size=(count, 3)))


@pytest.mark.parametrize("roughness", [0.3, 0.6, 1.0])
def test_a_white_mirror_returns_at_most_the_light_it_gets(
    rng: np.random.Generator, roughness: float
) -> None:
    """∫ f·cos over the hemisphere with f0 = 1: one bounce of a microfacet surface, no more."""
    alpha = np.array(roughness**2)
    light = sphere(rng)
    light = light[light[:, 2] > 0]
    for cosine in (0.9, 0.5):
        eye = np.array([np.sqrt(1 - cosine**2), 0.0, cosine])
        half = unit(light + eye)
        reflected = specular_brdf(
            np.ones((len(light), 3)),
            alpha,
            n_dot_l=light[:, 2],
            n_dot_v=np.full(len(light), cosine),
            n_dot_h=half[:, 2],
            v_dot_h=half @ eye,
        )
        total = 2 * np.pi * np.mean(reflected[:, 0] * light[:, 2])
        assert 0.3 < total < 1.01
        if roughness <= 0.3:
            assert total > 0.95  # almost none is lost between smooth facets


def test_reflection_is_the_same_both_ways(rng: np.random.Generator) -> None:
    l, v, h, d = rng.uniform(0.05, 1.0, (4, 50))  # noqa: E741 (the field's letters)
    forth = specular_brdf(np.full((50, 3), 0.04), l, n_dot_l=l, n_dot_v=v, n_dot_h=h, v_dot_h=d)
    back = specular_brdf(np.full((50, 3), 0.04), l, n_dot_l=v, n_dot_v=l, n_dot_h=h, v_dot_h=d)
    np.testing.assert_allclose(forth, back)


def test_the_environment_is_never_brightened() -> None:
    roughness, cosine = (
        a.ravel() for a in np.meshgrid(np.linspace(0, 1, 21), np.linspace(0, 1, 21))
    )
    scale, bias = environment_brdf(roughness, cosine)
    assert np.all(scale + bias <= 1.04)  # the fit's own error
    assert np.all(scale >= -0.05)
    smooth = environment_brdf(np.zeros(1), np.ones(1))
    np.testing.assert_allclose(smooth[0] + smooth[1], 1.0, atol=0.02)


def test_blurring_keeps_a_boxs_light(rng: np.random.Generator) -> None:
    directions = sphere(rng)
    shares = []
    for roughness in (0.1, 0.4):
        r = np.full(len(directions), roughness)
        light = studio.radiance(directions, r) - studio.gradient(directions[:, 1], 0.15 + r)
        shares.append(light.mean(axis=0))
    np.testing.assert_allclose(shares[0], shares[1], rtol=0.03)  # of 400,000 directions
    peak = [studio.radiance(studio.BOX_DIRECTIONS[:1], np.array([r]))[0, 0] for r in (0.1, 0.8)]
    assert peak[0] > 2 * peak[1]


def test_the_ceiling_is_above_the_floor() -> None:
    up = studio.gradient(np.array([-1.0, 0.15, 1.0]), np.full(3, 0.0001))
    np.testing.assert_allclose(up[0], studio.FLOOR)
    np.testing.assert_allclose(up[2], studio.CEILING, atol=1e-3)
    assert np.all(
        studio.diffuse(np.array([[0.0, 1, 0]])) > studio.diffuse(np.array([[0.0, -1, 0]]))
    )


# ---- placement --------------------------------------------------------------------------------


def test_normals_stay_square_to_their_surfaces(rng: np.random.Generator) -> None:
    matrix = np.eye(4)
    matrix[:3, :3] = rng.normal(size=(3, 3))
    along = rng.normal(size=(20, 2, 3))
    normals = unit(np.cross(along[:, 0], along[:, 1]))
    moved = along @ matrix[:3, :3].T
    turned = normals_by(matrix, normals)
    np.testing.assert_allclose(np.einsum("nx,nkx->nk", turned, moved), 0.0, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(turned, axis=1), 1.0)
    as_points = unit(normals @ matrix[:3, :3].T)
    assert np.abs(np.einsum("nx,nkx->nk", as_points, moved)).max() > 0.1
    # A mirror turns corners round and leaves normals on their side.
    mirrored = normals_by(np.diag([-1.0, 1.0, 1.0, 1.0]), normals)
    np.testing.assert_allclose(mirrored, normals * [-1.0, 1.0, 1.0])
    flattened = np.diag([1.0, 1.0, 0.0, 1.0])
    facing = np.sign(normals[:, 2:]) * [0.0, 0.0, 1.0]
    np.testing.assert_allclose(normals_by(flattened, normals), facing)

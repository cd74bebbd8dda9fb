"""Shading of visible pixels against the reference, given what the device found visible."""

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from lfd_render.display import DisplayProfile, Rig, ViewGrid
from lfd_render.gpu.device import Device
from lfd_render.reference import Visibility, shade, studio, textures, visible
from lfd_render.reference.pipeline import shade_over
from lfd_render.reference.shade import Shading
from lfd_render.scene import Image, Instance, Material, Scene, TextureSlot

from .helpers import (
    DISPLAYS,
    PAPER,
    examples,
    mesh_of,
    passes,
    placement,
    random_camera,
    random_grid,
    random_scene,
    shifted,
)

pytestmark = pytest.mark.needs("gl")

seeds = st.integers(0, 2**32 - 1)

# A step of the half floats that images hold, relative and near zero: llvmpipe cuts, others round.
HALF_STEP = 2.0**-10
HALF_SMALLEST = 2.0**-24


@dataclasses.dataclass(frozen=True, eq=False)
class Case:
    """Images from the device, and what the reference needs to make the same."""

    images: NDArray[np.float64]
    solid: Visibility
    blended: Visibility
    shading: Shading
    rig: Rig
    grid: ViewGrid
    background: tuple[float, float, float]

    def expected(self) -> NDArray[np.float64]:
        """Images of the reference, [view, row, column, rgb]."""
        linear = np.empty(self.images.shape)
        linear[...] = self.background
        old = self.shading
        fresh = Shading(old.scene, old.triangles, old.world_from_display, lod=old.lod)
        shade_over(linear, fresh, self.solid, self.rig, self.grid)
        shade_over(linear, fresh, self.blended, self.rig, self.grid)
        return linear

    def error(self) -> NDArray[np.float64]:
        """Difference beyond half floats' rounding, relative to colours above 1."""
        expected = self.expected()
        off = np.abs(self.images - expected)
        off -= HALF_STEP * np.abs(expected) + HALF_SMALLEST
        return np.maximum(off, 0.0) / np.maximum(1.0, np.abs(expected))


def case_of(
    device: Device,
    scene: Scene,
    rig: Rig,
    grid: ViewGrid,
    display_from_world: NDArray[np.float64] | None = None,
    *,
    lod: str = "area",
) -> Case:
    background = (0.25, 0.5, 0.0625)
    with passes(
        device, scene, rig, grid, display_from_world, background=background, lod=lod
    ) as opened:
        found, triangles = opened.winners(), opened.triangles()
        images = opened.images()
        shading = Shading(scene, triangles, np.linalg.inv(opened.display_from_world), lod=lod)
    solid = Visibility(found.solid, found.solid_depths.astype(np.float64))
    blended = Visibility(found.blended, found.blended_depths.astype(np.float64))
    return Case(images, solid, blended, shading, rig, grid, background)


# ---- one thing at a time ----------------------------------------------------------------------


def wall(
    material: Material,
    *,
    uv: float = 1.0,
    size_mm: float = 160.0,
    turn_rad: float = 0.0,
    normals: NDArray[np.floating] | None = None,
    colors: NDArray[np.floating] | None = None,
    images: tuple[Image, ...] = (),
    back: bool = False,
    mirrored: bool = False,
) -> Scene:
    """A square of two triangles about the window's middle, turned about the vertical axis."""
    square = np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]])
    cos, sin = np.cos(turn_rad), np.sin(turn_rad)
    corners = (
        0.5 * size_mm * np.column_stack([square[:, 0] * cos, square[:, 1], square[:, 0] * sin])
    )
    texcoords = uv * np.column_stack([0.5 + 0.5 * square[:, 0], 0.5 - 0.5 * square[:, 1]])
    order = np.array([[0, 1, 2], [0, 2, 3]])[:, :: -1 if back else 1]
    normal = np.array([-sin, 0.0, cos])
    mesh = mesh_of(
        corners[order],
        normals=np.broadcast_to(normal, (2, 3, 3)) if normals is None else normals,
        texcoords=np.stack([texcoords, texcoords[::-1] * 0.5], axis=1)[order],
        colors=colors,
    )
    matrix = np.diag([-1.0, 1, 1, 1]) if mirrored else np.eye(4)
    return Scene("wall", (mesh,), (Instance("wall", 0, matrix),), (material,), images)


def views(columns: int = 64, rows: int = 36, count: int = 3) -> tuple[Rig, ViewGrid]:
    profile = DisplayProfile.load(PAPER)
    return profile.rig(count), ViewGrid.upright(profile, columns, rows)


def noise(rng: np.random.Generator, width: int = 16, height: int = 8) -> Image:
    return Image("noise", rng.integers(0, 256, (height, width, 4)).astype(np.uint8))


def smooth(rng: np.random.Generator, size: int = 32) -> Image:
    """A picture whose neighbouring texels are alike, for what is not linear in texels."""
    y, x = np.mgrid[:size, :size] / size * 2 * np.pi
    waves = [np.sin(x + a) * np.cos(y + b) for a, b in rng.uniform(0, 6, (4, 2))]
    return Image("smooth", np.rint(127.5 + 90.0 * np.stack(waves, axis=-1)).astype(np.uint8))


def test_unlit_colours_are_exact(device: Device, rng: np.random.Generator) -> None:
    colors = rng.uniform(0.1, 1.0, (2, 3, 4))
    material = Material("flat", (0.9, 0.5, 0.3, 1.0), unlit=True)
    case = case_of(device, wall(material, colors=colors, turn_rad=0.7), *views())
    # Factors and vertex colours are 16-bit; float32 weights of a perspective view are off by 1e-6.
    assert case.error().max() < 2.0 / 65535
    assert case.solid.shown()[1].size > 500


@pytest.mark.parametrize("roughness", [0.0, 0.3, 0.6, 1.0])
@pytest.mark.parametrize("metallic", [0.0, 1.0])
def test_metals_and_dielectrics(device: Device, roughness: float, metallic: float) -> None:
    normals = np.array([[[-0.5, -0.4, 0.8], [0.4, -0.3, 0.9], [0.5, 0.6, 0.7]]] * 2)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    material = Material("lit", (0.9, 0.6, 0.2, 1.0), metallic=metallic, roughness=roughness)
    case = case_of(device, wall(material, normals=normals, turn_rad=0.3), *views())
    # Normals are rounded by up to 1e-4 rad, a mirror's rays by twice that, and the studio's boxes
    # change by up to 5·√40·e^(−½) = 19 a radian; 2e-5 measured.
    assert case.error().max() < 4e-3
    assert np.ptp(case.images[case.images[..., 1] != 0.5]) > 0.2


@pytest.mark.parametrize("uv", [0.05, 0.8, 3.0, 20.0, 400.0])
@pytest.mark.parametrize("wrap", ["repeat", "clamp", "mirror"])
def test_textures_are_filtered_by_area(
    device: Device, rng: np.random.Generator, uv: float, wrap: str
) -> None:
    slot = TextureSlot(0, wrap=(wrap, "repeat"))
    material = Material("picture", unlit=True, base_color_texture=slot)
    scene = wall(material, uv=uv, turn_rad=0.9, images=(noise(rng),))
    case = case_of(device, scene, *views())
    assert case.error().max() < texture_tolerance(uv)


def texture_tolerance(uv: float) -> float:
    """Devices filter with weights of 8 bits, and llvmpipe's mip levels are 8-bit sRGB: half a level
    is 0.0045 of linear light at its brightest, and a level is made of rounded ones. A coordinate
    is off by ε of itself, which is more of a texel the more of them repeat. 0.004 measured."""
    return 0.008 + 1e-5 * uv


def test_second_coordinates_and_transforms(device: Device, rng: np.random.Generator) -> None:
    turned = np.array([[0.6, -1.8, 0.3], [1.1, 0.6, -0.2], [0.0, 0.0, 1.0]])
    slot = TextureSlot(0, texcoord=1, wrap=("mirror", "clamp"), uv_transform=turned)
    material = Material("picture", unlit=True, base_color_texture=slot)
    case = case_of(device, wall(material, uv=2.0, images=(noise(rng),)), *views())
    assert case.error().max() < texture_tolerance(2.0)


def pbr(rng: np.random.Generator, *, shared: bool, **options: object) -> tuple[Material, tuple]:
    """A material with all five maps, occlusion in the metallic-roughness map or apart."""
    turned = np.array([[0.9, -0.5, 0.1], [0.4, 1.0, 0.2], [0.0, 0.0, 1.0]])
    material = Material(
        "full",
        (0.9, 0.8, 0.7, 1.0),
        metallic=0.8,
        roughness=0.9,
        emissive=(0.5, 1.5, 4.0),
        base_color_texture=TextureSlot(0),
        metallic_roughness_texture=TextureSlot(1),
        normal_texture=TextureSlot(2, scale=0.6, uv_transform=turned),
        occlusion_texture=TextureSlot(1 if shared else 3, scale=0.7, texcoord=0 if shared else 1),
        emissive_texture=TextureSlot(4, wrap=("mirror", "clamp")),
        **options,  # type: ignore[arg-type]
    )
    images = [smooth(rng) for _ in range(5)]
    roughness = images[1].pixels.copy()
    roughness[..., 1] = 130 + roughness[..., 1] // 3
    normal = images[2].pixels.copy()
    normal[..., 2] = 200 + normal[..., 2] // 8
    images[1], images[2] = Image("orm", roughness), Image("normal", normal)
    return material, tuple(images)


def full_case(device: Device, rng: np.random.Generator, shared: bool = False) -> Case:
    material, images = pbr(rng, shared=shared)
    return case_of(device, wall(material, turn_rad=0.4, images=images), *views())


# Lit texels are off by more than their maps: normals and roughness bend highlights; 0.011 measured.
FULL_TOLERANCE = 0.02


@pytest.mark.parametrize("shared", [False, True])
def test_all_five_maps(device: Device, rng: np.random.Generator, shared: bool) -> None:
    assert full_case(device, rng, shared).error().max() < FULL_TOLERANCE


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("back", [False, True])
def test_both_sides_and_mirrored_placements(
    device: Device, rng: np.random.Generator, back: bool, mirrored: bool
) -> None:
    material, images = pbr(rng, shared=True, double_sided=True)
    scene = wall(material, turn_rad=0.4, images=images, back=back, mirrored=mirrored)
    case = case_of(device, scene, *views())
    assert case.solid.shown()[1].size > 500
    assert case.error().max() < FULL_TOLERANCE


def test_glass_lies_over_what_is_solid(device: Device, rng: np.random.Generator) -> None:
    """The nearest of two panes counts, where it is no farther than what is solid."""
    glass = Material(
        "glass", (0.2, 0.9, 0.4, 0.6), alpha_mode="blend", double_sided=True, unlit=True,
        base_color_texture=TextureSlot(0),
    )  # fmt: skip
    solid = Material("solid", (0.8, 0.2, 0.1, 1.0), unlit=True)
    meshes, instances = [], []
    triangle = np.array([[[-60.0, -40, 0], [60, -40, 0], [0, 60, 0]]])
    uv = np.repeat(triangle[:, :, None, :2] / 120.0, 2, axis=2)
    picture = smooth(rng).pixels.copy()
    picture[:, :16, 3] = 0  # a clear half, through which the next pane shows
    for index, (z, kind) in enumerate(((0.0, 1), (40.0, 0), (20.0, 0), (-30.0, 0))):
        meshes.append(mesh_of(shifted(triangle, 8 * index, 4 * index, z), kind, texcoords=uv))
        instances.append(Instance(str(index), index, np.eye(4)))
    scene = Scene("glass", tuple(meshes), tuple(instances), (glass, solid), (Image("p", picture),))
    case = case_of(device, scene, *views())
    assert set(np.unique(case.blended.ids)) == {1, 2, 3, 0xFFFFFFFF}
    assert case.error().max() < texture_tolerance(1.0)
    # The planted fault of clear texels that hide the next pane.
    hidden = visible(case.shading.triangles, case.rig, case.grid, over=case.solid)
    assert np.count_nonzero(hidden.ids != case.blended.ids) > 50


# ---- everything at once -----------------------------------------------------------------------


@examples(15)
@given(seed=seeds)
def test_random_scenes(device: Device, seed: int) -> None:
    rng = np.random.default_rng(seed)
    profile, grid = random_grid(rng, DISPLAYS[rng.integers(len(DISPLAYS))])
    scene = random_scene(rng, profile, 20)
    camera = random_camera(rng, profile.size_mm)
    case = case_of(device, scene, profile.rig(int(rng.choice([1, 2, 7]))), grid, camera)
    error = case.error().max(axis=-1)
    # At most 0.004 measured; on a sliver a coordinate may run over more texels than float32 tells.
    assert np.count_nonzero(error > 0.01) <= 1e-3 * error.size


@pytest.mark.parametrize("lod", ["area", "anisotropic"])
def test_a_scene_of_many_groups_of_textures(
    device: Device, rng: np.random.Generator, lod: str
) -> None:
    """Sizes and wraps that need arrays of their own; each triangle still gets its own picture."""
    kinds = [(8, 8), (16, 8), (8, 16), (4, 4), (3, 5), (1, 1)]
    wraps = [("repeat", "repeat"), ("clamp", "mirror")]
    images = tuple(noise(rng, *size) for size in kinds)
    materials, meshes, instances = [], [], []
    for index in range(len(kinds) * len(wraps)):
        slot = TextureSlot(index % len(kinds), wrap=wraps[index // len(kinds)])  # type: ignore[arg-type]
        materials.append(Material(str(index), unlit=True, base_color_texture=slot))
        at = [40.0 * (index % 4) - 80, 40.0 * (index // 4) - 60, 0]
        triangle = np.array([[[0.0, 0, 0], [38, 0, 0], [0, 38, 0]]]) + at
        uv = np.repeat(rng.uniform(-1.0, 2.0, (1, 3, 1, 2)), 2, axis=2)
        meshes.append(mesh_of(triangle, index, texcoords=uv))
        instances.append(Instance(str(index), index, placement(rng)))
    scene = Scene("groups", tuple(meshes), tuple(instances), tuple(materials), images)
    case = case_of(device, scene, *views(128, 72, 2), lod=lod)
    assert len(np.unique(case.solid.ids)) == len(meshes) + 1
    # Magnified, so that odd sizes, whose mip levels devices make as they like, stay at level 0.
    assert case.error().max() < texture_tolerance(3.0)


# ---- planted faults ---------------------------------------------------------------------------


def _no_srgb(encoded: NDArray[np.float64]) -> NDArray[np.float64]:
    return encoded


def _coarser(*arguments: object) -> NDArray[np.float64]:
    return _area_lod(*arguments) + 1.0  # type: ignore[arg-type]


def _upside_down(pixels: NDArray[np.uint8], *, srgb: bool) -> list[NDArray[np.float64]]:
    return _mip_chain(pixels[::-1], srgb=srgb)


def _green_down(self: shade.Surface, role: str) -> NDArray[np.float64] | None:
    texels = _texture(self, role)
    if texels is not None and role == "normal_texture":
        texels = texels * [1, -1, 1, 1] + [0, 1, 0, 0]
    return texels


def _brighter(f0: NDArray[np.float64], *rest: object, **cosines: object) -> NDArray[np.float64]:
    return 1.2 * _specular(f0, *rest, **cosines)  # type: ignore[arg-type]


_area_lod, _mip_chain = textures.area_lod, shade.mip_chain
_texture, _specular = shade.Surface.texture, shade.specular_brdf


@pytest.mark.parametrize(
    ("owner", "name", "fault"),
    [
        (textures, "linear_from_srgb", _no_srgb),
        (textures, "area_lod", _coarser),
        (shade, "mip_chain", _upside_down),
        (shade.Surface, "texture", _green_down),
        (shade, "specular_brdf", _brighter),
        (studio, "CEILING", studio.CEILING * 1.3),
        (studio, "KEY_DIRECTION", studio.KEY_DIRECTION * [-1, 1, 1]),
    ],
)
def test_wrong_shading_is_caught(
    device: Device,
    rng: np.random.Generator,
    monkeypatch: pytest.MonkeyPatch,
    owner: object,
    name: str,
    fault: Callable[..., object],
) -> None:
    case = full_case(device, rng)
    monkeypatch.setattr(owner, name, fault)
    assert case.error().max() > FULL_TOLERANCE


@pytest.mark.parametrize("fault", [_coarser, textures.long_axis_lod])
def test_wrong_levels_of_detail_are_caught(
    device: Device,
    rng: np.random.Generator,
    monkeypatch: pytest.MonkeyPatch,
    fault: Callable[..., object],
) -> None:
    material = Material("picture", unlit=True, base_color_texture=TextureSlot(0))
    case = case_of(device, wall(material, uv=3.0, turn_rad=0.9, images=(noise(rng),)), *views())
    assert case.error().max() < texture_tolerance(3.0)
    monkeypatch.setattr(textures, "area_lod", fault)
    assert case.error().max() > texture_tolerance(3.0)


def test_wrong_sides_are_caught(device: Device, rng: np.random.Generator) -> None:
    case = full_case(device, rng)
    turned = dataclasses.replace(case.shading.triangles, mirrored=~case.shading.triangles.mirrored)
    shading = Shading(case.shading.scene, turned, case.shading.world_from_display)
    assert dataclasses.replace(case, shading=shading).error().max() > FULL_TOLERANCE

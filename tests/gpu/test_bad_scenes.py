"""Scene files with something wrong: a right picture, with a warning where something is left out, or
one clear error; never a pixel that is no number."""

import dataclasses
import json
import re
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from lfd_render import DisplayProfile, Renderer, Scene
from lfd_render.cli.main import main
from lfd_render.display import Rig
from lfd_render.errors import SceneError
from lfd_render.gpu.device import Device
from lfd_render.gpu.layout import LOD_RULES
from lfd_render.reference.textures import linear_from_srgb
from lfd_render.scene import Image, Light

from .helpers import PAPER, examples, few_lenses, millimetre_camera
from .scene_files import Ball, ball
from .wild import wild_scene

pytestmark = pytest.mark.needs("gl")

BACKGROUND = (0.0, 0.0, 1.0)
BOTH = ("gltf", "obj")
TECHNIQUES = ("lfdpr", "mvr")


@dataclass(frozen=True)
class Picture:
    """A panel image in linear light, which of its pixels show the scene, and the warnings."""

    linear: NDArray[np.float64]
    seen: NDArray[np.bool_]
    warnings: list[str]


@pytest.fixture(scope="module")
def small() -> DisplayProfile:
    """A display of 240 × 135 pixels."""
    return few_lenses(PAPER, 40.3, (240, 135))


@pytest.fixture(scope="module")
def draw(
    device: Device, small: DisplayProfile, tmp_path_factory: pytest.TempPathFactory
) -> Callable[..., Picture]:
    """``draw(ball, kind, technique)`` writes, loads and renders a scene."""
    renderer = Renderer(device)

    def rendered(shape: Ball, kind: str, technique: str) -> Picture:
        path = write(shape, kind, tmp_path_factory.mktemp("scene"))
        options = {"views": 8, "technique": technique, "background": BACKGROUND}
        eia = renderer.render(Scene.load(path), small, **options)
        seen = (eia.linear != np.array(BACKGROUND, np.float16)).any(axis=-1)
        return Picture(eia.linear.astype(np.float64), seen, eia.report["warnings"])

    return rendered


@pytest.fixture(scope="module")
def clean(draw: Callable[..., Picture]) -> dict[tuple[str, str], Picture]:
    """The unspoilt scene by kind of file and technique."""
    return {(kind, tech): draw(ball(), kind, tech) for kind in BOTH for tech in TECHNIQUES}


def write(shape: Ball, kind: str, folder: Path) -> Path:
    return shape.write_gltf(folder) if kind == "gltf" else shape.write_obj(folder)


# ---- ways to spoil it -------------------------------------------------------------------------


def degenerate(shape: Ball) -> None:
    """Triangles of one point, of two, and of three on a line, right in front."""
    count = len(shape.positions)
    line = np.array([[-0.3, 0.0, 0.99], [0.0, 0.0, 0.99], [0.3, 0.0, 0.99]])
    shape.positions = np.concatenate([shape.positions, line])
    shape.normals = np.concatenate([shape.normals, np.tile([0.0, 0.0, 1.0], (3, 1))])
    shape.texcoords = np.concatenate([shape.texcoords, np.zeros((3, 2))])
    empty = [[0, 0, 0], [40, 40, 70], [count, count + 1, count + 2]]
    shape.triangles = np.concatenate([shape.triangles, empty])


def scaled_by(factor: float) -> Callable[[Ball], None]:
    def spoil(shape: Ball) -> None:
        shape.positions = shape.positions * factor

    return spoil


def placed(**node: list[float]) -> Callable[[Ball], None]:
    def spoil(shape: Ball) -> None:
        shape.node = dict(node)

    return spoil


def mirrored(shape: Ball) -> None:
    """Mirrored in the file and back by its node."""
    shape.positions = shape.positions * [-1.0, 1.0, 1.0]
    shape.normals = shape.normals * [-1.0, 1.0, 1.0]
    shape.triangles = shape.triangles[:, ::-1]
    shape.node = {"scale": [-1.0, 1.0, 1.0]}


def without_normals(shape: Ball) -> None:
    shape.normals = None


def zero_normals(shape: Ball) -> None:
    shape.normals[::3] = 0.0


def no_normals_but_numbers_missing(shape: Ball) -> None:
    shape.normals[::3] = np.nan


def one_texcoord(shape: Ball) -> None:
    shape.texcoords[:] = 0.3


def texcoords_on_a_line(shape: Ball) -> None:
    shape.texcoords[:, 1] = shape.texcoords[:, 0]


def without_texcoords(shape: Ball) -> None:
    shape.texcoords = None


def huge_texcoords(shape: Ball) -> None:
    shape.texcoords = shape.texcoords * 1e30


NO_AREA = r"^triangles without area: 3, first in mesh '.+'; they are not seen$"
NO_UV_AREA = r"^triangles with a normal texture on coordinates without area: \d+, first in mesh"
REPLACED = r"108 normals without direction replaced$|107 normals without direction replaced$"

# Spoilt so that the picture must not change.
HARMLESS = {
    "degenerate": (degenerate, BOTH, NO_AREA),
    "a millionth": (scaled_by(1e-6), BOTH, None),
    "a million": (scaled_by(1e6), BOTH, None),
    "1e-30": (scaled_by(1e-30), BOTH, None),
    "1e30": (scaled_by(1e30), BOTH, None),
    "node 1e-6": (placed(scale=[1e-6] * 3), ("gltf",), None),
    "node 1e6": (placed(scale=[1e6] * 3), ("gltf",), None),
    "node 1e-160": (placed(scale=[1e-160] * 3), ("gltf",), None),
    "node 1e160": (placed(scale=[1e160] * 3), ("gltf",), None),
    "far away": (placed(translation=[1e6, -1e6, 1e6]), ("gltf",), None),
    "mirrored": (mirrored, ("gltf",), None),
}
# Spoilt so that the surface looks different, in the same place.
REPAIRED = {
    "without normals": (without_normals, BOTH, None),
    "zero normals": (zero_normals, BOTH, REPLACED),
    "nan normals": (no_normals_but_numbers_missing, BOTH, REPLACED),
    "one texture coordinate": (one_texcoord, BOTH, NO_UV_AREA),
    "texture coordinates on a line": (texcoords_on_a_line, BOTH, NO_UV_AREA),
    "no texture coordinates": (without_texcoords, BOTH, NO_UV_AREA),
    "huge texture coordinates": (huge_texcoords, BOTH, None),
}


def _cases(table: dict[str, tuple]) -> list:
    return [
        pytest.param(spoil, kind, technique, warning, id=f"{name}-{kind}-{technique}")
        for name, (spoil, kinds, warning) in table.items()
        for kind in kinds
        for technique in TECHNIQUES
    ]


def _checked(found: Picture, expected: Picture, warning: str | None) -> None:
    assert np.isfinite(found.linear).all()
    # Vertices that round otherwise may move an edge over a pixel's centre.
    assert np.count_nonzero(found.seen != expected.seen) <= 1e-3 * expected.seen.sum()
    if warning is None:
        assert found.warnings == []
    else:
        assert len(found.warnings) == 1
        assert re.search(warning, found.warnings[0])


@pytest.mark.parametrize(("spoil", "kind", "technique", "warning"), _cases(HARMLESS))
def test_what_is_harmless_leaves_the_picture_alone(
    draw: Callable[..., Picture],
    clean: dict[tuple[str, str], Picture],
    spoil: Callable[[Ball], None],
    kind: str,
    technique: str,
    warning: str | None,
) -> None:
    shape, expected = ball(), clean[kind, technique]
    spoil(shape)
    found = draw(shape, kind, technique)
    _checked(found, expected, warning)
    # Texture coordinates rounded otherwise: a texel's noise at a few pixels, 0.022 measured.
    error = np.abs(found.linear - expected.linear)
    assert error.max() < 0.1
    assert error.mean() < 2e-4


@pytest.mark.parametrize(("spoil", "kind", "technique", "warning"), _cases(REPAIRED))
def test_what_is_repaired_covers_the_same(
    draw: Callable[..., Picture],
    clean: dict[tuple[str, str], Picture],
    spoil: Callable[[Ball], None],
    kind: str,
    technique: str,
    warning: str | None,
) -> None:
    shape, expected = ball(), clean[kind, technique]
    spoil(shape)
    found = draw(shape, kind, technique)
    _checked(found, expected, warning)
    # It is lit like the ball it is: neither black nor burnt out.
    ratio = found.linear[found.seen].mean() / expected.linear[expected.seen].mean()
    assert 0.5 < ratio < 2.0


def broken_picture(shape: Ball) -> None:
    shape.pictures["bumps.png"] = b"\x89PNG\r\n\x1a\nbroken"


def cut_picture(shape: Ball) -> None:
    shape.pictures["base.png"] = shape.pictures["base.png"][:200]


def infinite_texcoord(shape: Ball) -> None:
    shape.texcoords[5] = np.inf


def infinite_position(shape: Ball) -> None:
    shape.positions[5] = 1e39  # beyond single precision


HOPELESS = {
    "broken picture": (broken_picture, BOTH, "bumps.png.*cannot be decoded.*give a whole PNG"),
    "cut picture": (cut_picture, BOTH, "base.png.*cannot be decoded.*give a whole PNG"),
    "infinite coordinate": (infinite_texcoord, BOTH, r"texcoords\[5\].*give finite numbers"),
    "infinite position": (infinite_position, BOTH, r"positions\[5\].*give finite numbers"),
    "too small": (scaled_by(1e-42), BOTH, "too small, large or far away"),
    "node 1e-300": (placed(scale=[1e-300] * 3), ("gltf",), "neither too small nor too large"),
    "node 1e300": (placed(scale=[1e300] * 3), ("gltf",), "neither too small nor too large"),
    "node 5e-324": (placed(scale=[5e-324] * 3), ("gltf",), "neither too small nor too large"),
}


@pytest.mark.parametrize(("spoil", "kind", "technique", "message"), _cases(HOPELESS))
def test_what_is_hopeless_is_refused_in_one_line(
    draw: Callable[..., Picture],
    spoil: Callable[[Ball], None],
    kind: str,
    technique: str,
    message: str,
) -> None:
    shape = ball()
    spoil(shape)
    with pytest.raises(SceneError, match=message) as caught:
        draw(shape, kind, technique)
    assert "\n" not in str(caught.value)


# ---- normal maps without a direction ----------------------------------------------------------


def texcoords_on_a_slanted_line(shape: Ball) -> None:
    """Rounding leaves triangles an area of their coordinates: of none that means anything."""
    shape.texcoords[:, 1] = 0.7 * shape.texcoords[:, 0] + 0.1


def texcoords_on_a_level_line(shape: Ball) -> None:
    shape.texcoords[:, 1] = 0.3


@pytest.mark.parametrize("technique", TECHNIQUES)
@pytest.mark.parametrize(
    "spoil",
    [
        one_texcoord,
        texcoords_on_a_line,
        texcoords_on_a_level_line,
        texcoords_on_a_slanted_line,
        without_texcoords,
    ],
)
def test_a_normal_map_is_left_out_where_its_coordinates_have_no_area(
    device: Device,
    small: DisplayProfile,
    tmp_path: Path,
    spoil: Callable[[Ball], None],
    technique: str,
) -> None:
    """The picture is that of the material without the map, to the bit but for single pixels of MVR,
    whose coordinates hardware interpolates: in the triangles of a pole they lose more than others.
    """
    shape = ball()
    spoil(shape)
    scene = Scene.load(shape.write_gltf(tmp_path))
    materials = tuple(dataclasses.replace(m, normal_texture=None) for m in scene.materials)
    bare = dataclasses.replace(scene, materials=materials)
    with Renderer(device) as renderer:
        found, expected = (
            renderer.render(s, small, views=4, technique=technique).linear for s in (scene, bare)
        )
    assert np.mean(found != expected) <= (1e-4 if technique == "mvr" else 0.0)
    assert found.std() > 0.1


# ---- numbers at their limits ------------------------------------------------------------------


def poisoned(rng: np.random.Generator, profile: DisplayProfile) -> Scene:
    """A wild scene (`wild`) of extremes: no normals or wrong ones, black and burning colours, huge
    texture coordinates, normal maps without direction, placements from 1e-6 to 1e6 that stretch,
    mirror and flatten, lights of any power in the middle of surfaces."""
    scene = wild_scene(rng, profile, 12)
    meshes = []
    for mesh in scene.meshes:
        normals, texcoords, colors = (a.copy() for a in (mesh.normals, mesh.texcoords, mesh.colors))
        normals[rng.random(len(normals)) < 0.2] = 0.0
        normals[rng.random(len(normals)) < 0.2] *= -1.0
        texcoords[rng.random(len(texcoords)) < 0.2] *= 10.0 ** rng.uniform(-30.0, 30.0)
        colors[rng.random(len(colors)) < 0.2] = 0.0
        meshes.append(
            dataclasses.replace(mesh, normals=normals, texcoords=texcoords, colors=colors)
        )
    materials = tuple(
        dataclasses.replace(
            material,
            metallic=float(rng.integers(0, 2)),
            roughness=float(rng.integers(0, 2)),
            emissive=tuple(10.0 ** rng.uniform(-30.0, 30.0, 3) * rng.integers(0, 2)),
        )
        for material in scene.materials
    )
    grey = np.full((4, 4, 4), 127, np.uint8)
    images = (Image("black", 0 * grey), Image("no direction", grey), *scene.images[2:])
    instances = []
    for instance in scene.instances:
        matrix = instance.world_from_local.copy()
        matrix[:3, :3] *= 10.0 ** rng.uniform(-6.0, 6.0, 3) * rng.choice([-1.0, 0.0, 1.0, 1.0], 3)
        instances.append(dataclasses.replace(instance, world_from_local=matrix))
    lights = []
    for kind in ("directional", "point", "spot"):
        matrix = np.eye(4)
        matrix[:3, 3] = scene.meshes[0].positions[0]
        power = 10.0 ** rng.uniform(-30.0, 30.0)
        lights.append(Light(kind, kind, matrix, intensity=power, outer_cone_rad=1e-6))  # type: ignore[arg-type]
    return Scene(
        "poisoned", tuple(meshes), (*scene.instances, *instances), materials, images,
        lights=tuple(lights) if rng.random() < 0.7 else (),
    )  # fmt: skip


@examples(3)
@given(
    seed=st.integers(0, 2**32 - 1),
    options=st.sampled_from(
        [
            *({"lod": rule} for rule in LOD_RULES),
            {"technique": "mvr"},
            {"technique": "mvr", "lod": "area"},
            {"preset": "paper"},
            {"projection": "general"},
            {"splat": "two-pass", "environment": "none"},
        ]
    ),
)
def test_no_pixel_is_ever_no_number(
    device: Device, small: DisplayProfile, seed: int, options: dict[str, object]
) -> None:
    rng = np.random.default_rng(seed)
    scene = poisoned(rng, small)
    camera = millimetre_camera(small.size_mm, depth_scale=10.0 ** rng.uniform(-6.0, 1.0))
    with Renderer(device) as renderer:
        eia = renderer.render(scene, small, camera, views=3, background=BACKGROUND, **options)
    assert np.isfinite(eia.linear).all()
    assert eia.linear.min() >= 0.0


# ---- very many materials ----------------------------------------------------------------------


@pytest.mark.parametrize("technique", TECHNIQUES)
def test_each_of_very_many_materials_shows(
    device: Device,
    rng: np.random.Generator,
    tmp_path: Path,
    scaled: Callable[[int, int], int],
    technique: str,
) -> None:
    side = scaled(256, 48)  # 65,536 or 2,304 glowing tiles
    colors = rng.uniform(0.2, 0.7, (side, side, 3))
    obj, mtl = ["mtllib tiles.mtl"], []
    for row, column in np.ndindex(side, side):
        red, green, blue = colors[row, column]
        mtl.append(f"newmtl {row} {column}\nKd 0 0 0\nPr 1\nKe {red} {green} {blue}")
        x, y = column, side - row
        obj.append(f"v {x} {y} 0\nv {x} {y - 1} 0\nv {x + 1} {y - 1} 0\nv {x + 1} {y} 0")
        obj.append(f"usemtl {row} {column}\nf -4 -3 -2 -1")
    (tmp_path / "tiles.mtl").write_text("\n".join(mtl), encoding="utf-8")
    (tmp_path / "tiles.obj").write_text("\n".join(obj), encoding="utf-8")
    scene = Scene.load(tmp_path / "tiles.obj")
    assert len(scene.materials) == side * side

    display = few_lenses(PAPER, 40.3, (400, 400))
    middle, width, rows = Rig.single(display, 0.0), 8 * side, 5 * side
    with Renderer(device) as renderer:
        options = {"technique": technique, "view_size": (width, rows)}
        (picture,) = renderer.views(scene, display, rig=middle, **options)
    inside = np.argwhere(picture.any(axis=-1))
    (top, left), (bottom, right) = inside.min(axis=0), inside.max(axis=0) + 1
    centres = (np.arange(side) + 0.5) / side
    y = (top + centres * (bottom - top)).astype(int)
    x = (left + centres * (right - left)).astype(int)
    found = linear_from_srgb(picture[np.ix_(y, x)] / 255.0)
    # Above what a tile glows with, black plastic mirrors 4 % of a studio of radiance about 1.
    off = found - colors
    assert off.min() > -0.01
    assert off.max() < 0.08


@pytest.mark.parametrize("technique", TECHNIQUES)
def test_very_many_materials_that_are_alike_look_like_one(
    device: Device,
    small: DisplayProfile,
    tmp_path: Path,
    scaled: Callable[[int, int], int],
    technique: str,
) -> None:
    """As glTF has them: so many primitives as well, each a batch's run of its own."""
    shape = ball(300, 120) if scaled(1, 0) else ball(60, 24)
    count = scaled(65_536, 1_000)
    (tmp_path / "one").mkdir()
    many, one = Scene.load(shape.write_gltf(tmp_path, count)), shape.write_gltf(tmp_path / "one")
    assert len(many.materials) == count
    with Renderer(device) as renderer:
        found, expected = (
            renderer.render(scene, small, views=8, technique=technique).linear
            for scene in (many, Scene.load(one))
        )
    np.testing.assert_array_equal(found, expected)


# ---- the command line -------------------------------------------------------------------------


def command(monkeypatch: pytest.MonkeyPatch, *arguments: object) -> int:
    monkeypatch.setattr(sys, "argv", ["lfd-render", *map(str, arguments)])
    return main()


@pytest.mark.parametrize("technique", TECHNIQUES)
def test_the_command_line_warns_and_renders(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    small: DisplayProfile,
    technique: str,
) -> None:
    shape = ball()
    degenerate(shape)
    one_texcoord(shape)
    (tmp_path / "small.json").write_text(small.to_json(), encoding="utf-8")
    path = shape.write_gltf(tmp_path)
    code = command(
        monkeypatch, "render", path, "-d", tmp_path / "small.json",
        "-o", tmp_path / "out.png", "--technique", technique, "--views", 8, "--json",
    )  # fmt: skip
    out, err = capsys.readouterr()
    assert code == 0
    of_display, *warnings = json.loads(out)["warnings"]
    assert of_display.startswith("display 'gavane-2024-tilted-4k': its figures")
    assert len(warnings) == 2
    assert re.search(NO_AREA, warnings[0])
    assert re.search(NO_UV_AREA, warnings[1])
    assert all(f"lfd-render: warning: {path}: {warning}\n" in err for warning in warnings)


def test_the_command_line_refuses_a_broken_picture(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    shape = ball()
    cut_picture(shape)
    path = shape.write_obj(tmp_path)
    assert command(monkeypatch, "render", path, "-o", tmp_path / "out.png") == 3
    _, err = capsys.readouterr()
    (error,) = [line for line in err.splitlines() if "warning:" not in line]
    assert error.startswith(f"lfd-render: error: {path}: material 'ball': ball.mtl line 2: map_kd")
    assert not (tmp_path / "out.png").exists()

"""OBJ and MTL reading: index forms, polygons, materials, normals, bad lines."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lfd_render.errors import LfdError, SceneError
from lfd_render.scene import Scene

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


@pytest.fixture
def load(tmp_path: Path) -> Callable[..., Scene]:
    """``load(text, **{"a.mtl": text})`` writes an OBJ file and others beside it, and loads it."""

    def write_and_load(text: str | bytes, **others: str | bytes) -> Scene:
        for name, content in {"model.obj": text, **others}.items():
            data = content if isinstance(content, bytes) else content.encode()
            (tmp_path / name).write_bytes(data)
        return Scene.load(tmp_path / "model.obj")

    return write_and_load


def corners(scene: Scene, mesh: int = 0) -> np.ndarray:
    return scene.meshes[mesh].positions[scene.meshes[mesh].triangles]


@pytest.mark.parametrize(
    "face",
    [
        "f 1 2 3",
        "f 1/1 2/2 3/3",
        "f 1//1 2//1 3//1",
        "f 1/1/1 2/2/1 3/3/1",
        "f -4 -3 -2",
        "f -4/-3/-1 -3/-2/-1 -2/-1/-1",
        "f 1/1/1 2//1 3/3",
        "f 1/ 2/ 3/",
        "f 1// 2// 3//",
        "  f\t1   2 3  # a corner",
        "f 1 2 \\\n 3",
    ],
)
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_every_form_of_index(load: Callable[..., Scene], face: str, end: str) -> None:
    head = SQUARE + "vt 0 0\nvt 1 0\nvt 1 1\nvn 0 0 2\n"
    scene = load((head + face).replace("\n", end))
    np.testing.assert_array_equal(corners(scene)[0], [[0, 0, 0], [1, 0, 0], [1, 1, 0]])
    np.testing.assert_array_equal(scene.meshes[0].normals, np.tile([0, 0, 1], (3, 1)))


def test_texture_coordinates_run_down_the_picture(load: Callable[..., Scene]) -> None:
    scene = load(SQUARE + "vt 0.25 0.1\nvt 1\nvt 1 1 0\nf 1/1 2/2 3/3")
    uv = scene.meshes[0].texcoords[:, 0]
    np.testing.assert_allclose(uv, [[0.25, 0.9], [1, 1], [1, 0]], rtol=1e-6)


def test_negative_indices_count_back_from_their_own_line(load: Callable[..., Scene]) -> None:
    scene = load("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 5 5\nv 6 5 5\nv 5 6 5\nf -3 -2 -1\n")
    np.testing.assert_array_equal(corners(scene)[:, 0], [[0, 0, 0], [5, 5, 5]])


def test_polygons_become_fans(load: Callable[..., Scene]) -> None:
    scene = load(SQUARE + "v 0.5 2 0\nf 1 2 3 5 4\nf 1 2 3\nf 1 2\n")
    found = corners(scene)
    assert len(found) == 4
    areas = np.cross(found[:, 1] - found[:, 0], found[:, 2] - found[:, 0])[:, 2] / 2
    assert (areas > 0).all()
    assert areas[:3].sum() == pytest.approx(1.5)


def test_smooth_normals_cross_texture_seams_and_doubled_vertices(
    load: Callable[..., Scene],
) -> None:
    # Two squares fold along x = 0; the fold's vertices are written twice, once as −0.
    text = (
        "v -1 0 0\nv 0 0 0\nv 0 1 0\nv -1 1 0\n"
        "v -0 0 0\nv 0 0 -1\nv 0 1 -1\nv -0 1 0\nf 1 2 3 4\nf 8 5 6 7\n"
    )
    mesh = load(text).meshes[0]
    fold = mesh.positions[:, (0, 2)].any(axis=1) == 0
    assert fold.sum() == 4
    np.testing.assert_allclose(
        mesh.normals[fold], np.tile([0.5**0.5, 0, 0.5**0.5], (4, 1)), atol=1e-6
    )


def test_normals_are_made_where_some_are_missing(load: Callable[..., Scene]) -> None:
    mesh = load(SQUARE + "vn 1 0 0\nvn 0 0 0\nf 1//1 2//2 3").meshes[0]
    np.testing.assert_array_equal(mesh.normals, [[1, 0, 0], [0, 0, 1], [0, 0, 1]])


def test_vertex_colours_are_srgb(load: Callable[..., Scene]) -> None:
    mesh = load("v 0 0 0 1 0.5 0\nv 1 0 0 1 0.5 0\nv 0 1 0 1 0.5 0\nf 1 2 3").meshes[0]
    np.testing.assert_allclose(mesh.colors[0], (1, 0.21404, 0, 1), atol=1e-5)


def test_a_fourth_coordinate_is_ignored(load: Callable[..., Scene]) -> None:
    assert load("v 0 0 0 1\nv 1 0 0 1.0\nv 0 1 0\nf 1 2 3").triangle_count == 1


def test_one_mesh_a_material(load: Callable[..., Scene]) -> None:
    scene = load(
        "mtllib a.mtl\nf 1 2 3\n" + SQUARE + "usemtl red\nf 1 2 3\nusemtl blue\nf 1 2 3 4\n"
        "usemtl red\nf 2 3 4\nusemtl never\n",
        **{"a.mtl": "newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\nnewmtl never\nmap_Kd none.png\n"},
    )
    assert [(m.name, len(m.triangles)) for m in scene.meshes] == [
        ("model", 1),
        ("red", 2),
        ("blue", 2),
    ]
    assert [m.base_color[:3] for m in scene.materials] == [(0.8, 0.8, 0.8), (1, 0, 0), (0, 0, 1)]
    assert scene.images == ()


def test_material_statements(load: Callable[..., Scene], picture_bytes: Any) -> None:
    picture = picture_bytes(np.full((2, 2, 3), 9, np.uint8))
    text = """
        newmtl all            # comments end a line
        Kd 0.1 0.2 0.3
        Ke 2 3 4
        Ns 0
        d 0.5
        Pm 0.25
        norm a b.png
        map_Ke -clamp on -s 2 4 -o 0.5 0.25 a b.png
        map_Bump bump.png
        newmtl picture
        Kd 0 0 0
        Tr 0
        Ns 198
        map_Kd a b.png
        map_d a b.png
        newmtl grey
        Kd 0.5
        Pr 0.75
    """
    faces = "usemtl all\nf 1 2 3\nusemtl picture\nf 1 2 3\nusemtl grey\nf 1 2 3\n"
    scene = load(
        "mtllib the mtl.mtl\n" + SQUARE + faces, **{"the mtl.mtl": text, "a b.png": picture}
    )
    full, picture_material, grey = scene.materials
    assert full.base_color == (0.1, 0.2, 0.3, 0.5)
    assert full.emissive == (2, 3, 4)
    assert (full.alpha_mode, full.metallic, full.roughness) == ("blend", 0.25, 1.0)
    assert full.normal_texture is not None
    assert full.emissive_texture is not None
    assert full.emissive_texture.wrap == ("clamp", "clamp")
    assert full.emissive_texture.uv_transform is not None
    # At the picture's top v is 1 for OBJ: 1·4 + 0.25 = 4.25, which is 1 − 4.25 from the top.
    moved = full.emissive_texture.uv_transform @ (0.5, 0.0, 1.0)
    np.testing.assert_allclose(moved, (1.5, 1 - 4.25, 1))
    assert picture_material.base_color == (1, 1, 1, 1)
    assert picture_material.alpha_mode == "mask"
    assert picture_material.roughness == pytest.approx(0.01**0.25)
    assert grey.base_color[:3] == (0.5, 0.5, 0.5)
    assert grey.roughness == 0.75
    assert all(m.double_sided for m in scene.materials)
    assert len(scene.images) == 1
    assert scene.warnings == (
        "material 'all': map_bump is left out",
        "triangles with a normal texture on coordinates without area: 1, first in mesh 'all'; "
        "it is left out there",
    )


def test_what_is_missing_gives_a_warning_and_grey(load: Callable[..., Scene]) -> None:
    scene = load("mtllib none.mtl\n" + SQUARE + "usemtl red\nf 1 2 3\n")
    assert scene.warnings == (
        "line 1: mtllib: 'none.mtl' is not there; its materials are drawn in grey",
        "usemtl: 'red' is not defined; it is drawn in grey",
    )


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "f: no face with three corners"),
        (SQUARE, "f: no face with three corners"),
        (SQUARE + "f 1 2", "f: no face with three corners"),
        ("v 0 0\nf 1 2 3", "line 1: 'v 0 0'; give three coordinates"),
        ("v 0 0 0\nv 0 x 0\n", "line 2: 'v 0 x 0'; give numbers after 'v'"),
        ("v 0 0 1-2", "line 1: 'v 0 0 1-2'"),
        ("v 0 0 0x10", "line 1: 'v 0 0 0x10'"),
        ("v 0 0 nan\nv 0 0 0\nv 1 0 0\nf 1 2 3", "positions[0]: [0.0, 0.0, nan]"),
        ("v 0 0 1e999\nv 0 0 0\nv 1 0 0\nf 1 2 3", "positions[0]: [0.0, 0.0, inf]"),
        ("v 0 0 1e300\nv 0 0 0\nv 1 0 0\nf 1 2 3", "positions[0]: [0.0, 0.0, inf]"),
        (SQUARE + "vn 0 1\nf 1 2 3", "line 5: 'vn 0 1'; give 3 numbers"),
        (SQUARE + "f 1 2 5", "line 5: 'f 1 2 5'; give v indices from 1 to 4"),
        (SQUARE + "f 0 1 2", "line 5: 'f 0 1 2'; give v indices from 1 to 4"),
        (SQUARE + "f -5 1 2", "line 5: 'f -5 1 2'; give v indices"),
        (SQUARE + "\n\nf 1/1 2 3", "line 7: 'f 1/1 2 3'; give vt indices from 1 to 0"),
        (SQUARE + "f 1 2 99999999999999999999", "line 5: 'f 1 2 99999999999999999999'"),
        (SQUARE + "f 1 2 3.5", "line 5: 'f 1 2 3.5'; give numbers after 'f'"),
        (SQUARE + "f 1 2 a\nf 1 2 3", "line 5: 'f 1 2 a'"),
        (SQUARE + "f 1/1/1/1 2 3", "line 5: 'f 1/1/1/1 2 3'; give corners as v"),
        (SQUARE + "f 1 \\\n2 \\\n 3\nf 1 2 9", "line 8: 'f 1 2 9'"),
        (SQUARE + "f / / /", "line 5: 'f / / /'"),
        ("mtllib ../a.mtl\n" + SQUARE + "f 1 2 3", "line 1: mtllib: '../a.mtl'; give"),
        ("mtllib /etc/passwd\n" + SQUARE + "f 1 2 3", "line 1: mtllib: '/etc/passwd'"),
        (b"v 0 0 0\n\0\xff\xfe\nf 1 1 \xff1", "line 3: 'f 1 1 ÿ1'"),
    ],
)
def test_bad_lines_are_named(load: Callable[..., Scene], text: str | bytes, expected: str) -> None:
    with pytest.raises(SceneError) as caught:
        load(text)
    assert expected in str(caught.value)
    assert str(caught.value).isprintable()


@pytest.mark.parametrize(
    ("mtl", "expected"),
    [
        ("Kd a", "a.mtl line 2: kd: 'a'; give finite numbers"),
        ("Kd nan 0 0", "a.mtl line 2: kd: 'nan 0 0'"),
        ("Kd", "a.mtl line 2: kd: ''"),
        ("Kd spectral file.rfl", "give red, green and blue"),
        ("map_Kd", "a.mtl line 2: map_kd: ''; give a picture's file name"),
        ("map_Kd -s 1 1", "give a picture's file name"),
        ("map_Kd -z 1 a.png", "option '-z'"),
        ("map_Kd none.png", "material 'm': a.mtl line 2: map_kd: 'none.png': cannot be read"),
        ("map_Kd ..\\..\\secret.png", "'../../secret.png'; give a data URI or a file inside"),
        ("map_Kd a.mtl", "starts with 6e 65 77 6d"),
    ],
)
def test_bad_material_statements_are_named(
    load: Callable[..., Scene], mtl: str, expected: str
) -> None:
    with pytest.raises(SceneError) as caught:
        load("mtllib a.mtl\n" + SQUARE + "usemtl m\nf 1 2 3", **{"a.mtl": "newmtl m\n" + mtl})
    assert expected in str(caught.value)


def test_mutated_files_never_fail_otherwise(
    load: Callable[..., Scene], rng: np.random.Generator
) -> None:
    whole = (
        "mtllib a.mtl\n" + SQUARE + "vt 0 0\nvn 0 0 1\nusemtl m\nf 1/1/1 2//1 3 4\nf -1 -2 -3\n"
    ).encode()
    outcomes = set()
    for _ in range(300):
        data = bytearray(whole)
        for place in rng.integers(0, len(data), rng.integers(1, 4)):
            data[place] = rng.choice(np.frombuffer(b"0129-./ vfn#\\\n\0\xff", np.uint8))
        try:
            load(bytes(data), **{"a.mtl": "newmtl m\nKd 1 1 1\n"})
            outcomes.add("loaded")
        except LfdError as error:
            outcomes.add("refused" if str(error).isprintable() else repr(error))
    assert outcomes == {"loaded", "refused"}


@pytest.mark.parametrize(
    ("name", "triangles", "low", "high"),
    [
        ("spot.obj", 5_856, (-0.471549, -0.736784, -0.668909), (0.471549, 0.95378, 1.04906)),
        (
            "stanford-bunny.obj",
            69_451,
            (-0.09469, 0.032987, -0.061874),
            (0.061009, 0.187321, 0.0588),
        ),
        ("nefertiti.obj", 99_938, (-119.323, -181.293, -247.268), (119.363, 181.241, 247.337)),
        ("teapot.obj", 6_320, (-3, 0, -2), (3.434, 3.15, 2)),
    ],
)
def test_real_models(
    assets: Path, name: str, triangles: int, low: tuple[float, ...], high: tuple[float, ...]
) -> None:
    scene = Scene.load(assets / "obj" / name)
    assert scene.triangle_count == triangles
    size = max(np.subtract(high, low))
    np.testing.assert_allclose(scene.bounds(), (low, high), atol=1e-3 * size)
    (mesh,) = scene.meshes
    corner = mesh.positions[mesh.triangles].astype(np.float64)
    face = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    agree = np.einsum("mc,mc->m", face, mesh.normals[mesh.triangles].sum(axis=1)) >= 0
    assert agree.mean() > 0.98
    assert mesh.texcoords.any() == (name == "spot.obj")

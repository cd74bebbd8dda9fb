"""The built-in scenes: counts, closed surfaces, orientation, texture maps, framing, options."""

from dataclasses import replace

import numpy as np
import pytest

from lfd_render.errors import SceneError
from lfd_render.scene import Material, Mesh, Scene
from lfd_render.scene.procedural.chart import CARDS
from lfd_render.scene.procedural.materials import floor_tiles
from lfd_render.scene.procedural.textures import mosaic, noise

NAMES = ("atrium", "car", "chart", "coconuts", "gallery", "spheres")
LEAST = {"atrium": 20_000, "car": 20_000, "coconuts": 50_000}  # of the others a thousand
SOLIDS = {"atrium": 10, "car": 50, "chart": 0, "coconuts": 3, "gallery": 12, "spheres": 9}
OPEN = {"floor", "ceiling", "ground", "backdrop", "curtain", "fibres", "fronds"}
OPEN_KINDS = ("wall", "painting", "card", "ruler", "cloth")


def load(name: str, triangles: int) -> Scene:
    textures = "&textures=32" if name in ("atrium", "coconuts", "gallery") else ""
    triangles = max(triangles, LEAST.get(name, 0))
    return Scene.load(f"builtin:{name}?triangles={triangles}{textures}")


def closed(name: str) -> bool:
    return name not in OPEN and not any(kind in name for kind in OPEN_KINDS)


def edge_balance(mesh: Mesh) -> np.ndarray:
    """Times each edge is walked forwards minus backwards, by bit-identical positions."""
    _, vertex = np.unique(mesh.positions, axis=0, return_inverse=True)
    faces = vertex.reshape(-1)[mesh.triangles].astype(np.int64)
    starts, ends = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    real = starts != ends
    starts, ends = starts[real], ends[real]
    key = np.minimum(starts, ends) * len(mesh.positions) + np.maximum(starts, ends)
    _, edge = np.unique(key, return_inverse=True)
    return np.bincount(edge, np.where(starts < ends, 1, -1))


def edge_uses(mesh: Mesh) -> np.ndarray:
    """Triangles at each edge, by bit-identical positions."""
    _, vertex = np.unique(mesh.positions, axis=0, return_inverse=True)
    faces = vertex.reshape(-1)[mesh.triangles].astype(np.int64)
    pairs = np.sort(np.stack((faces, np.roll(faces, -1, axis=1)), axis=-1).reshape(-1, 2), axis=1)
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    return np.unique(pairs, axis=0, return_counts=True)[1]


def signed_volume(mesh: Mesh) -> float:
    a, b, c = (mesh.positions[mesh.triangles[:, i]].astype(np.float64) for i in range(3))
    return float(np.einsum("mc,mc->", a, np.cross(b, c)) / 6.0)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("triangles", [1_000, 4_321, 100_000])
def test_the_count_is_reached(name: str, triangles: int) -> None:
    triangles = max(triangles, LEAST.get(name, 0))
    assert load(name, triangles).triangle_count == pytest.approx(triangles, rel=0.03)


@pytest.mark.parametrize("name", NAMES)
def test_meshes_are_sound(name: str) -> None:
    scene = load(name, 100_000)
    for mesh in scene.meshes:
        np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1, atol=1e-5)
        spread = np.ptp(mesh.texcoords[:, 0], axis=0)
        assert (spread >= 0.99).all() or not scene.images, (
            f"{mesh.name}: texture coordinates span {spread}"
        )
        face = np.cross(
            mesh.positions[mesh.triangles[:, 1]] - mesh.positions[mesh.triangles[:, 0]],
            mesh.positions[mesh.triangles[:, 2]] - mesh.positions[mesh.triangles[:, 0]],
        )
        agree = np.einsum("mc,mc->m", face, mesh.normals[mesh.triangles].sum(axis=1)) >= 0
        assert agree.mean() > 0.97, f"{mesh.name}: normals against the winding"


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("triangles", [1_000, 30_000])
def test_solids_are_watertight_and_face_outwards(name: str, triangles: int) -> None:
    solids = [m for m in load(name, triangles).meshes if closed(m.name)]
    assert len(solids) == SOLIDS[name]
    for mesh in solids:
        assert (edge_uses(mesh) == 2).all(), mesh.name
        assert (edge_balance(mesh) == 0).all(), mesh.name
        assert signed_volume(mesh) > 0, mesh.name


def test_the_watertight_check_catches_a_planted_crack_and_a_flip() -> None:
    good = load("spheres", 1_000).meshes[0]
    seam = np.flatnonzero(good.texcoords[:, 0, 0] == 1.0)[2]  # neither in a pole's line
    positions = good.positions.copy()
    positions[seam] *= np.float32(1 + 1e-6)
    assert (edge_uses(replace(good, positions=positions)) != 2).any()
    triangles = good.triangles.copy()
    triangles[40] = triangles[40, ::-1]
    assert (edge_balance(replace(good, triangles=triangles)) != 0).any()


def test_a_sphere_is_round() -> None:
    mesh = load("spheres", 100_000).meshes[0]
    radius = np.linalg.norm(mesh.positions, axis=1)
    np.testing.assert_allclose(radius, 0.5, rtol=1e-6)
    np.testing.assert_allclose(mesh.normals, mesh.positions / 0.5, atol=0.02)


def slots(material: Material) -> set[str]:
    return set(material.texture_slots())


def test_every_surface_of_the_gallery_has_its_maps() -> None:
    scene = load("gallery", 1_000)
    used = {mesh.material for mesh in scene.meshes}
    assert used == set(range(len(scene.materials)))
    four = {
        "base_color_texture",
        "normal_texture",
        "metallic_roughness_texture",
        "occlusion_texture",
    }
    for material in scene.materials:
        assert slots(material) >= four, material.name
    lamps = [m for m in scene.materials if max(m.emissive) > 1]
    assert [slots(m) - four for m in lamps] == [{"emissive_texture"}]


def test_textures_have_the_asked_size_and_tile() -> None:
    scene = Scene.load("builtin:gallery?triangles=1000&textures=256")
    for image in scene.images:
        assert image.pixels.shape == (256, 256, 4)
        assert (image.pixels[..., 3] == 255).all()
        assert np.ptp(image.pixels[..., :3].astype(int), axis=(0, 1)).max() > 0, image.name
    normals = next(i for i in scene.images if i.name == "plaster normal").pixels[..., :3]
    vectors = normals / 127.5 - 1.0
    np.testing.assert_allclose(np.linalg.norm(vectors, axis=-1), 1, atol=0.02)
    assert vectors[..., 2].min() > 0


def test_noise_tiles_and_repeats() -> None:
    field = noise(64, 5)
    np.testing.assert_array_equal(field, noise(64, 5))
    assert abs(field.mean()) < 1e-5
    inner = np.abs(np.diff(field, axis=1)).mean()
    seam = np.abs(field[:, 0] - field[:, -1]).mean()
    assert seam < 2 * inner


def test_normal_maps_point_up_the_picture_where_the_surface_does() -> None:
    """Of a bump, the side toward the picture's top has a normal with +y, as glTF asks."""
    from lfd_render.scene.procedural.textures import grid, normal_pixels  # noqa: PLC0415

    u, v = grid(64)
    bump = 0.1 * np.exp(-((u - 0.5) ** 2 + (v - 0.5) ** 2) / 0.02)
    pixels = normal_pixels(bump.astype(np.float32)).astype(int)
    assert pixels[20, 32, 1] > 150  # above the middle
    assert pixels[44, 32, 1] < 105
    assert pixels[32, 44, 0] > 150  # right of the middle
    assert pixels[32, 20, 0] < 105


@pytest.mark.parametrize("name", NAMES)
def test_texture_v_runs_down_and_u_to_the_right(name: str) -> None:
    """Seen from the front, no texture is mirrored: ∂p/∂v × ∂p/∂u is the front normal."""
    for mesh in load(name, 30_000).meshes:
        corner = mesh.positions[mesh.triangles].astype(np.float64)
        uv = mesh.texcoords[mesh.triangles][:, :, 0].astype(np.float64)
        area = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        one, two = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
        turned = one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]
        real = np.linalg.norm(area, axis=1) > 0
        assert (turned[real] < 0).mean() > 0.99, mesh.name


def inner_room(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """The largest box that no wall, floor or ceiling reaches into, reliefs counted."""
    part = {m.name: m.positions.astype(np.float64) for m in scene.meshes}
    low = (part["left wall"][:, 0].max(), part["floor"][:, 1].max(), part["back wall"][:, 2].max())
    above = [
        part[name][:, 1].min() for name in ("ceiling", "loft wall", "vault wall") if name in part
    ]
    high = (
        part["right wall"][:, 0].min(),
        min(above),
        part["front wall"][:, 2].min(),
    )
    return np.array(low), np.array(high)


@pytest.mark.parametrize("name", ["atrium", "gallery"])
@pytest.mark.parametrize(("width", "height"), [(345.4, 194.3), (120.4, 160.6)])
def test_halls_fill_the_window_for_every_eye_at_any_yaw(
    rng: np.random.Generator, width: float, height: float, name: str
) -> None:
    """Each ray from an eye of a 40° cone through the window crosses the box inside the room.

    Whatever leaves that box meets a wall, since the walls face inwards and overlap at their edges.
    """
    scene = load(name, 100_000)
    low, high = inner_room(scene)
    camera = scene.default_camera
    assert camera is not None
    count = 20_000
    distance = 3.09 * height
    eye = np.zeros((count, 3))
    eye[:, 0] = rng.uniform(-1, 1, count) * distance * np.tan(np.deg2rad(20))
    eye[:, 2] = distance
    window = rng.uniform(-0.5, 0.5, (count, 3)) * (width, height, 0)
    scale = camera["window_height"] / height
    yaw = rng.uniform(0, 2 * np.pi, count)

    def to_world(p_display: np.ndarray) -> np.ndarray:
        x, y, z = (p_display * (1, 1, 1 / camera["depth_scale"]) * scale).T
        return np.stack(
            (x * np.cos(yaw) - z * np.sin(yaw), y, x * np.sin(yaw) + z * np.cos(yaw)), 1
        )

    start = to_world(eye)
    ray = to_world(window) - start
    first, second = (low - start) / ray, (high - start) / ray
    enters = np.minimum(first, second).max(axis=1)
    leaves = np.maximum(first, second).min(axis=1)
    near = 0.05  # of the distance, as the rig has it
    assert (leaves > np.maximum(enters, near)).all()


def test_the_walls_of_the_gallery_overlap_along_every_edge() -> None:
    scene = load("gallery", 100_000)
    low, high = inner_room(scene)
    part = {m.name: m.positions for m in scene.meshes}
    for name, along in {
        "floor": (0, 2),
        "ceiling": (0, 2),
        "left wall": (1, 2),
        "right wall": (1, 2),
        "back wall": (0, 1),
        "front wall": (0, 1),
    }.items():
        for axis in along:
            assert part[name][:, axis].min() < low[axis], name
            assert part[name][:, axis].max() > high[axis], name


def test_the_car_hides_most_of_what_it_is_made_of() -> None:
    """Rays along z through the body cross fifty surfaces at most and often eight."""
    scene = load("car", 50_000)
    crossings = np.zeros((24, 64), int)
    x = np.linspace(-1.9, 1.9, 64)
    y = np.linspace(-0.42, 0.2, 24)
    for instance in scene.instances:
        mesh, place = scene.meshes[instance.mesh], instance.world_from_local
        p = mesh.positions @ place[:3, :3].T + place[:3, 3]
        corner = p[mesh.triangles][..., :2]
        for a, b, c in corner[(np.ptp(corner, axis=1) > 0).all(axis=-1)]:
            low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
            i, j = np.searchsorted(y, (low[1], high[1])), np.searchsorted(x, (low[0], high[0]))
            gx, gy = x[slice(*j)][None, :], y[slice(*i)][:, None]
            if gx.size and gy.size:
                crossings[slice(*i), slice(*j)] += _inside(gx, gy, a, b, c)
    assert crossings.max() >= 50
    assert np.percentile(crossings[crossings > 0], 66) >= 8
    assert not scene.images


def _inside(x: np.ndarray, y: np.ndarray, *corners: np.ndarray) -> np.ndarray:
    """Whether points lie in a triangle of either winding."""
    signs = [
        (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]) > 0
        for a, b in zip(corners, (*corners[1:], corners[0]), strict=True)
    ]
    return np.logical_or(np.all(signs, axis=0), ~np.any(signs, axis=0))


def test_a_gallery_of_very_large_textures_has_a_floor_of_many_slabs() -> None:
    """Put together from blocks; here small ones, whose numbers are as those of 16,384 texels."""
    images = mosaic(lambda seed: floor_tiles(32, seed).images(), 3)
    assert [image.pixels.shape for image in images] == [(96, 96, 4)] * 3
    blocks = images[0].pixels.reshape(3, 32, 3, 32, 4).swapaxes(1, 2).reshape(9, -1)
    assert len(np.unique(blocks, axis=0)) == 9


def test_gallery_content_stands_on_both_sides_of_the_panel() -> None:
    scene = load("gallery", 10_000)
    depth = [i.world_from_local[2, 3] for i in scene.instances if "knot" in i.name]
    assert min(depth) < 0 < max(depth)


def test_the_chart_stands_where_it_says() -> None:
    scene = load("chart", 10_000)
    assert sorted(z for _, _, z in CARDS)[4] == 0.0
    by_name = {mesh.name: mesh for mesh in scene.meshes}
    for x, y, z in CARDS:
        positions = by_name[f"card {z:+.2f}"].positions
        np.testing.assert_allclose(positions[:, 2], z, atol=1e-7)
        np.testing.assert_allclose(positions.mean(axis=0)[:2], (x, y), atol=1e-6)
    assert all(m.unlit for m in scene.materials)
    assert scene.default_camera == {
        "target": [0, 0, 0],
        "eye_direction": [0, 0, 1],
        "up": [0, 1, 0],
        "window_height": 1,
    }


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("builtin:", "builtin: ''; give one of atrium, car, chart, coconuts, gallery, spheres"),
        (
            "builtin:hall",
            "builtin: 'hall'; give one of atrium, car, chart, coconuts, gallery, spheres",
        ),
        ("builtin:spheres?color=1", "option: 'color'; spheres takes triangles"),
        ("builtin:gallery?n=1", "option: 'n'; gallery takes textures, triangles"),
        ("builtin:spheres?triangles=999", "triangles: '999'; give a whole number from 1000 to"),
        ("builtin:spheres?triangles=30000001", "triangles: '30000001'"),
        ("builtin:spheres?triangles=-1000", "triangles: '-1000'"),
        ("builtin:spheres?triangles=1e6", "triangles: '1e6'"),
        ("builtin:spheres?triangles=", "triangles: ''"),
        ("builtin:spheres?triangles=" + "9" * 5000, "99'; give a whole number from 1000"),
        ("builtin:spheres?triangles", "options: 'triangles'; write them as name=value"),
        ("builtin:gallery?textures=8", "textures: '8'; give a whole number from 16 to 16384"),
    ],
)
def test_unknown_builtins_and_options(source: str, expected: str) -> None:
    with pytest.raises(SceneError) as caught:
        Scene.load(source)
    text = str(caught.value)
    assert expected in text
    assert text.isprintable()
    assert ";" in text


@pytest.mark.parametrize("textures", [16, 17, 100])
def test_textures_of_any_size(textures: int) -> None:
    scene = Scene.load(f"builtin:gallery?triangles=1000&textures={textures}")
    assert {i.pixels.shape for i in scene.images} == {(textures, textures, 4)}

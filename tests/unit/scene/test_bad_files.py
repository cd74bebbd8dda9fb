"""Bad scene files: each gives one line with the file, the field, the value and the remedy."""

import json
import os
import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lfd_render.errors import LfdError, ResourceError, SceneError
from lfd_render.scene import LoadLimits, Scene

TRIANGLE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)


def message(path: Path | str, kind: type[LfdError] = SceneError, **limits: int) -> str:
    """The message of loading a bad scene, after its general promises are checked."""
    with pytest.raises(LfdError) as caught:
        Scene.load(path, LoadLimits(**limits) if limits else None)
    text = str(caught.value)
    assert type(caught.value) is kind
    assert text.startswith(f"{path}: ")
    assert text.isprintable()  # so it is one line
    assert ";" in text, "no remedy"
    return text.removeprefix(f"{path}: ")


def test_a_missing_file(tmp_path: Path) -> None:
    assert message(tmp_path / "none.gltf").startswith("file: cannot be read (No such file")


def test_a_folder_and_a_pipe_are_no_files(tmp_path: Path) -> None:
    (tmp_path / "a.gltf").mkdir()
    os.mkfifo(tmp_path / "b.gltf")
    assert "not a regular file" in message(tmp_path / "a.gltf")
    assert "not a regular file" in message(tmp_path / "b.gltf")


def test_an_unknown_suffix(tmp_path: Path) -> None:
    assert message(tmp_path / "scene.fbx").startswith("suffix: '.fbx'; give .gltf, .glb")


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (b"", "cannot be parsed"),
        (b"{", "cannot be parsed"),
        (b"[]", "JSON: []; give a JSON object"),
        (b"{}", "asset: missing"),
        (b'{"asset": {}}', "asset.version: missing"),
        (b'{"asset": {"version": "1.0"}}', "asset.version: '1.0'; convert the file to glTF 2.0"),
        (b'{"asset": {"version": "2.0", "minVersion": "2.1"}}', "asset.minVersion: '2.1'"),
        (b'{"asset": {"version": 2}}', "asset.version: 2"),
        (b'{"asset": {"version": "2.0"}}', "0 triangles"),
        (b'{"asset": {"version": "2.0"}, "x": NaN}', "NaN is no JSON number"),
        (b'{"asset": {"version": "2.\xff"}}', "byte 0xff at"),
        (b'{"asset":' * 100_000, "nested too deeply"),
        (b'{"asset": ' + b"9" * 5000 + b"}", "cannot be parsed"),
        (b'{"asset": {"version": "2.0"}, "nodes": 3}', "nodes: 3; give a list"),
        (b'{"asset": {"version": "2.0"}, "nodes": [3]}', "nodes[0]: 3; give a JSON object"),
        (b'{"asset": {"version": "\\u001b[31m\\n"}}', "asset.version: '"),
    ],
)
def test_json_that_is_no_gltf(tmp_path: Path, data: bytes, expected: str) -> None:
    path = tmp_path / "scene.gltf"
    path.write_bytes(data)
    assert expected in message(path)


@pytest.mark.parametrize("keep", [4, 12, 19, 20, 40, -60, -1])
def test_a_truncated_glb(gltf: Any, keep: int) -> None:
    gltf.triangle()
    path = gltf.write_glb()
    path.write_bytes(path.read_bytes()[:keep])
    assert message(path).startswith("header")


@pytest.mark.parametrize(
    ("offset", "value", "expected"),
    [
        (4, 1, "header.version: 1"),
        (8, 4, "header.length: 4"),
        (12, 1 << 31, "chunks[0].length: 2147483648"),
        (16, 7, "chunks[0].type: 0x7"),
    ],
)
def test_a_glb_with_a_wrong_header(gltf: Any, offset: int, value: int, expected: str) -> None:
    gltf.triangle()
    path = gltf.write_glb()
    data = bytearray(path.read_bytes())
    struct.pack_into("<I", data, offset, value)
    path.write_bytes(data)
    assert expected in message(path)


def bend(gltf: Any, place: str, value: Any) -> None:
    """Set the field at a dotted path like `nodes.0.mesh`."""
    *way, last = (int(k) if k.isdigit() else k for k in place.split("."))
    target = gltf.json
    for key in way:
        target = target[key]
    target[last] = value


@pytest.mark.parametrize(
    ("place", "value", "expected"),
    [
        ("nodes.0.mesh", 1, "nodes[0].mesh: 1; give an index from 0 to 0"),
        ("nodes.0.mesh", "0", "nodes[0].mesh: '0'"),
        ("nodes.0.mesh", True, "nodes[0].mesh: true"),
        ("nodes.0.children", [7], "nodes[0].children[0]: 7"),
        ("nodes.0.skin", 0, "nodes[0].skin: 0; the file has none"),
        ("nodes.0.matrix", [1, 2], "nodes[0].matrix: [1, 2]; give 16 finite numbers"),
        ("nodes.0.matrix", [1] * 16, "nodes[0].matrix: [1, 1"),
        ("nodes.0.scale", [1, 1e999, 1], "Infinity is no JSON number"),
        ("nodes.0.scale", [1, 10**400, 1], "nodes[0].scale: [1, 1000"),
        ("nodes.0.rotation", [0, 0, 0, 0], "nodes[0].rotation: [0, 0, 0, 0]"),
        ("nodes.0.name", 5, "nodes[0].name: 5; give a string"),
        ("scenes", [{"nodes": [0, 0]}], "scenes[0].nodes: a node stands twice"),
        ("scene", 3, "scene: 3; the file has none"),
        ("meshes.0.primitives", [], "meshes[0].primitives: []"),
        ("meshes.0.primitives.0.mode", 7, "primitives[0].mode: 7"),
        ("meshes.0.primitives.0.attributes", {}, "attributes.POSITION: missing"),
        ("meshes.0.primitives.0.attributes.POSITION", 9, "attributes.POSITION: 9"),
        ("meshes.0.primitives.0.attributes.NORMAL", 1, "POSITION 3"),
        ("meshes.0.primitives.0.indices", 0, "accessors[0].componentType: 5126"),
        ("meshes.0.primitives.0.indices", 1, "indices: index 3 out of range"),
        ("meshes.0.primitives.0.material", 0, "material: 0; the file has none"),
        ("accessors.0.count", 4, "accessors[0].count: 4; needs 48 bytes"),
        ("accessors.0.count", 10**12, "accessors[0].count: 1000000000000; needs"),
        ("accessors.0.count", 0, "accessors[0].count: 0; give a whole number from 1"),
        ("accessors.0.count", -1, "accessors[0].count: -1"),
        ("accessors.0.byteOffset", 4, "accessors[0].count: 3; needs 40 bytes"),
        ("accessors.0.byteOffset", -4, "accessors[0].byteOffset: -4"),
        ("accessors.0.componentType", 5124, "accessors[0].componentType: 5124"),
        ("accessors.0.type", "VEC2", "accessors[0].type: 'VEC2'; give VEC3 here"),
        ("accessors.0.type", "VEC5", "accessors[0].type: 'VEC5'"),
        ("accessors.0.bufferView", 9, "accessors[0].bufferView: 9"),
        ("bufferViews.0.byteLength", 1 << 40, "bufferViews[0]: bytes 4 to"),
        ("bufferViews.0.byteOffset", 1 << 40, "bufferViews[0]: bytes"),
        ("bufferViews.0.byteStride", 4, "bufferViews[0].byteStride: 4"),
        ("bufferViews.0.buffer", 1, "bufferViews[0].buffer: 1"),
        ("buffers", [{"byteLength": 12}], "buffers[0].uri: missing"),
        ("buffers", [{"byteLength": 99, "uri": "data:;base64,AAAA"}], "byteLength: 99"),
        ("buffers", [{"byteLength": 3, "uri": "data:;base64,A*AA"}], "base64 data is broken"),
        ("buffers", [{"byteLength": 3, "uri": "data:AAAA"}], "give data:[type][;base64],BYTES"),
        ("extensionsRequired", ["KHR_draco_mesh_compression"], "(Draco compressed meshes)"),
        ("extensionsRequired", ["EXT_meshopt_compression"], "(meshopt compressed buffers)"),
        ("extensionsRequired", ["MADE_up"], "extensionsRequired: 'MADE_up' is not supported"),
        ("cameras", [{"type": "fish"}], "cameras[0].type: 'fish'"),
    ],
)
def test_a_wrong_field_is_named(gltf: Any, place: str, value: Any, expected: str) -> None:
    gltf.triangle(indices=gltf.accessor(np.array([0, 1, 2], "u1")))
    gltf.accessor(np.array([0, 1, 3], "u1"))
    # accessors: 0 the good indices, 1 positions, 2 indices out of range; positions come first.
    entries = gltf.json["accessors"]
    gltf.json["accessors"] = [entries[1], entries[2], entries[0]]
    views = gltf.json["bufferViews"]
    gltf.json["bufferViews"] = [views[1], views[2], views[0]]
    for entry, view in zip(gltf.json["accessors"], (0, 1, 2), strict=True):
        entry["bufferView"] = view
    primitive = gltf.json["meshes"][0]["primitives"][0]
    primitive |= {"attributes": {"POSITION": 0}, "indices": 2}
    if place == "cameras":
        gltf.json["nodes"][0]["camera"] = 0
    if place == "meshes.0.primitives.0.attributes.NORMAL":
        normals = np.zeros((4, 3), np.float32)
        value = gltf.accessor(normals)
    bend(gltf, place, value)
    assert expected in message(gltf.write())


def test_huge_counts_without_bytes(gltf: Any) -> None:
    gltf.triangle()
    accessor = gltf.json["accessors"][0]
    del accessor["bufferView"]
    accessor["count"] = 4_000_000_000
    assert message(gltf.write()).startswith("accessors[0].count: 4000000000; ")


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_vertices_that_are_no_numbers(gltf: Any, value: float) -> None:
    positions = TRIANGLE.copy()
    positions[1, 2] = value
    gltf.node(mesh=gltf.mesh(gltf.primitive(positions), name="blob"))
    assert message(gltf.write()).startswith("mesh 'blob': positions[1]: [1.0, 0.0, ")


def test_transforms_that_overflow(gltf: Any) -> None:
    gltf.triangle()
    gltf.json["nodes"][0]["scale"] = [1e200] * 3
    gltf.node(children=[0], scale=[1e200] * 3)
    assert "nodes[0]: its world transform overflows" in message(gltf.write())


def test_node_cycles(gltf: Any) -> None:
    gltf.triangle()
    gltf.node(children=[2])
    gltf.node(children=[1])
    assert "nodes[1].children: node 1 is its own ancestor" in message(gltf.write())


def test_a_node_with_two_parents(gltf: Any) -> None:
    gltf.triangle()
    gltf.node(children=[0])
    gltf.node(children=[0])
    assert "node 0 is already a child of node 1" in message(gltf.write())


def test_a_scene_that_lists_a_child(gltf: Any) -> None:
    gltf.triangle()
    gltf.node(children=[0])
    gltf.json["scenes"] = [{"nodes": [1, 0]}]
    assert "scenes[0].nodes: node 0 is a child of node 1" in message(gltf.write())


def test_a_sparse_index_out_of_range(gltf: Any) -> None:
    gltf.triangle()
    gltf.json["accessors"][0]["sparse"] = {
        "count": 1,
        "indices": {"bufferView": gltf.view(b"\x03\0\0\0"), "componentType": 5125},
        "values": {"bufferView": gltf.view(bytes(12))},
    }
    expected = "accessors[0].sparse.indices: index 3; the accessor has 3 elements"
    assert expected in message(gltf.write())


def test_a_joint_that_the_skin_lacks(gltf: Any) -> None:
    weights = np.array([[1, 0, 0, 0]] * 3, np.float32)
    joints = np.array([[0, 2, 0, 0]] * 3, "u1")
    gltf.node(mesh=gltf.mesh(gltf.primitive(JOINTS_0=joints, WEIGHTS_0=weights)), skin=0)
    gltf.append("skins", {"joints": [0]})
    assert "attributes.JOINTS_0: 1; joint 2 is named, the skin has 1" in message(gltf.write())


@pytest.mark.parametrize(
    "uri",
    [
        "../outside.bin",
        "sub/../../outside.bin",
        "%2e%2e/outside.bin",
        "/etc/hostname",
        "file:///etc/hostname",
        "http://example.org/outside.bin",
        "C:\\outside.bin",
        "sub\\..\\outside.bin",
        "link.bin",
        "folder/outside.bin",
        "nul\0.bin",
        "loop",
        "",
        ".",
    ],
)
def test_no_uri_leads_out_of_the_folder(gltf: Any, uri: str) -> None:
    outside = gltf.folder.parent / "outside.bin"
    outside.write_bytes(bytes(36))
    (gltf.folder / "link.bin").symlink_to(outside)
    (gltf.folder / "folder").symlink_to(gltf.folder.parent)
    (gltf.folder / "loop").symlink_to(gltf.folder / "loop")
    gltf.triangle()
    gltf.json["buffers"] = [{"byteLength": 36, "uri": uri}]
    text = message(gltf.write())
    assert text.startswith("buffers[0].uri")
    assert "inside the scene's folder" in text or "not a regular file" in text


def textured(gltf: Any, uri: str) -> None:
    """A triangle whose normal map is the picture at a URI."""
    gltf.append("materials", {"name": "brass", "normalTexture": gltf.texture(uri)})
    gltf.triangle(material=0)


def test_a_missing_texture_names_material_slot_and_file(gltf: Any) -> None:
    textured(gltf, "maps/none.png")
    text = message(gltf.write())
    assert text.startswith("material 'brass': normalTexture: images[0].uri: 'maps/none.png': ")
    assert "No such file" in text


@pytest.mark.parametrize(
    "damage",
    [
        lambda data: data[: len(data) // 2],
        lambda data: data[:20],
        lambda data: data[:60] + bytes(20) + data[80:],
        lambda data: b"",
        lambda data: b"GIF89a" + data,
    ],
)
@pytest.mark.parametrize("kind", ["PNG", "JPEG", "WEBP"])
def test_a_damaged_texture(
    gltf: Any,
    picture_bytes: Callable[..., bytes],
    rng: np.random.Generator,
    kind: str,
    damage: Callable[[bytes], bytes],
) -> None:
    pixels = rng.integers(0, 256, (40, 40, 3), np.uint8)
    whole = picture_bytes(pixels, kind)
    (gltf.folder / "map").write_bytes(damage(whole))
    textured(gltf, "map")
    if kind != "PNG" and len(damage(whole)) == len(whole):
        return  # without checksums, wrong pixels are pixels
    assert "material 'brass': normalTexture: images[0].uri: 'map': " in message(gltf.write())


def png_header(width: int, height: int) -> bytes:
    """A PNG that claims a size and holds a few bytes."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        checked = kind + data
        return struct.pack(">I", len(data)) + checked + struct.pack(">I", zlib.crc32(checked))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    data = zlib.compress(bytes(1000))
    return (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")
    )


def test_a_picture_bomb_is_refused_by_its_header(gltf: Any) -> None:
    (gltf.folder / "bomb.png").write_bytes(png_header(100_000, 100_000))
    textured(gltf, "bomb.png")
    assert "100000 × 100000 pixels" in message(gltf.write(), ResourceError)


def test_all_pictures_together_have_a_limit(gltf: Any, picture_bytes: Callable[..., bytes]) -> None:
    (gltf.folder / "a.png").write_bytes(picture_bytes(np.zeros((8, 8, 3), np.uint8)))
    materials = [{"normalTexture": gltf.texture("a.png")} for _ in range(3)]
    gltf.json["materials"] = materials
    primitive = gltf.primitive()
    gltf.node(mesh=gltf.mesh(*({**primitive, "material": i} for i in range(3))))
    assert Scene.load(gltf.write(), LoadLimits(texels=192)).triangle_count == 3
    text = message(gltf.write(), ResourceError, texels=191)
    assert "texels: 192 and more; the limit is 191" in text


@pytest.mark.parametrize(
    ("limits", "expected"),
    [
        ({"file_bytes": 100}, "file: more than 100 bytes"),
        ({"mesh_bytes": 100}, "mesh_bytes: 180 and more; the limit is 100"),
        ({"nodes": 0}, "nodes: 1; the limit is 0"),
        ({"drawn_triangles": 0}, "instances: 1 triangles drawn; the limit is 0"),
    ],
)
def test_limits(gltf: Any, limits: dict[str, int], expected: str) -> None:
    gltf.triangle()
    assert expected in message(gltf.write(), ResourceError, **limits)


def test_long_and_unprintable_names_do_not_flood_the_message(gltf: Any) -> None:
    gltf.node(mesh=gltf.mesh(gltf.primitive(TRIANGLE * np.float32(np.nan)), name="x\n\x1b" * 5000))
    assert len(message(gltf.write())) <= 500


def outcome(path: Path) -> str:
    """Whether a file of unknown sanity loads or is refused; any other end is an error."""
    try:
        Scene.load(path)
    except LfdError as error:
        return "refused" if str(error).isprintable() else f"not one line: {error!r}"
    return "loaded"


def test_mutated_files_never_fail_otherwise(gltf: Any, rng: np.random.Generator) -> None:
    """Bytes of a small scene are overwritten at random: it loads, or the error is ours."""
    gltf.triangle(indices=gltf.accessor(np.array([0, 1, 2], "u1")))
    gltf.append("materials", {"pbrMetallicRoughness": {"roughnessFactor": 0.5}})
    path = gltf.write_glb()
    whole = path.read_bytes()
    outcomes = set()
    for _ in range(300):
        data = bytearray(whole)
        for place in rng.integers(0, len(data), rng.integers(1, 5)):
            data[place] = rng.choice(np.frombuffer(b'0129-.e"[]{},:\0\xff', np.uint8))
        path.write_bytes(data)
        outcomes.add(outcome(path))
    assert outcomes == {"loaded", "refused"}


def test_json_values_of_wrong_kinds_never_fail_otherwise(gltf: Any) -> None:
    """Every value of the document is replaced in turn by values of other kinds."""
    gltf.append("materials", {"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 1]}})
    gltf.append("cameras", {"type": "perspective", "perspective": {"yfov": 1}})
    gltf.triangle(indices=gltf.accessor(np.array([0, 1, 2], "u1")), material=0)
    gltf.json["nodes"][0] |= {"camera": 0, "translation": [0, 0, 1]}
    gltf.json |= {"scenes": [{"nodes": [0]}], "scene": 0}
    document = json.loads(gltf.text())
    path = gltf.folder / "bent.gltf"

    def places(value: Any) -> list[tuple[Any, Any]]:
        pairs = value.items() if isinstance(value, dict) else enumerate(value)
        found = [(value, key) for key, _ in pairs]
        for owner, key in list(found):
            if isinstance(owner[key], dict | list):
                found += places(owner[key])
        return found

    for owner, key in places(document):
        kept = owner[key]
        for wrong in (None, True, -1, 1.5, 1e300, "", "x", [], [None], {}, {"a": 1}, 2**70):
            owner[key] = wrong
            path.write_text(json.dumps(document))
            assert outcome(path) in ("loaded", "refused")
        owner[key] = kept

"""Bad scene files: each gives one line with the file, the field, the value and the remedy."""

import json
import os
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lfd_render.errors import LfdError, ResourceError
from lfd_render.scene import Scene

Message = Callable[..., str]
TRIANGLE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)


def test_a_missing_file(message: Message, tmp_path: Path) -> None:
    assert message(tmp_path / "none.gltf").startswith("file: cannot be read (No such file")


def test_a_folder_and_a_pipe_are_no_files(message: Message, tmp_path: Path) -> None:
    (tmp_path / "a.gltf").mkdir()
    os.mkfifo(tmp_path / "b.gltf")
    assert "not a regular file" in message(tmp_path / "a.gltf")
    assert "not a regular file" in message(tmp_path / "b.gltf")


def test_an_unknown_suffix(message: Message, tmp_path: Path) -> None:
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
def test_json_that_is_no_gltf(message: Message, tmp_path: Path, data: bytes, expected: str) -> None:
    path = tmp_path / "scene.gltf"
    path.write_bytes(data)
    assert expected in message(path)


@pytest.mark.parametrize("keep", [4, 12, 19, 20, 40, -60, -1])
def test_a_truncated_glb(message: Message, gltf: Any, keep: int) -> None:
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
def test_a_glb_with_a_wrong_header(
    message: Message, gltf: Any, offset: int, value: int, expected: str
) -> None:
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
def test_a_wrong_field_is_named(
    message: Message, gltf: Any, place: str, value: Any, expected: str
) -> None:
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


def test_huge_counts_without_bytes(message: Message, gltf: Any) -> None:
    gltf.triangle()
    accessor = gltf.json["accessors"][0]
    del accessor["bufferView"]
    accessor["count"] = 4_000_000_000
    assert message(gltf.write()).startswith("accessors[0].count: 4000000000; ")


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_vertices_that_are_no_numbers(message: Message, gltf: Any, value: float) -> None:
    positions = TRIANGLE.copy()
    positions[1, 2] = value
    gltf.node(mesh=gltf.mesh(gltf.primitive(positions), name="blob"))
    assert message(gltf.write()).startswith("mesh 'blob': positions[1]: [1.0, 0.0, ")


def test_transforms_that_overflow(message: Message, gltf: Any) -> None:
    gltf.triangle()
    gltf.json["nodes"][0]["scale"] = [1e200] * 3
    gltf.node(children=[0], scale=[1e200] * 3)
    assert "nodes[0]: its world transform overflows" in message(gltf.write())


def test_node_cycles(message: Message, gltf: Any) -> None:
    gltf.triangle()
    gltf.node(children=[2])
    gltf.node(children=[1])
    assert "nodes[1].children: node 1 is its own ancestor" in message(gltf.write())


def test_a_node_with_two_parents(message: Message, gltf: Any) -> None:
    gltf.triangle()
    gltf.node(children=[0])
    gltf.node(children=[0])
    assert "node 0 is already a child of node 1" in message(gltf.write())


def test_a_scene_that_lists_a_child(message: Message, gltf: Any) -> None:
    gltf.triangle()
    gltf.node(children=[0])
    gltf.json["scenes"] = [{"nodes": [1, 0]}]
    assert "scenes[0].nodes: node 0 is a child of node 1" in message(gltf.write())


def test_a_sparse_index_out_of_range(message: Message, gltf: Any) -> None:
    gltf.triangle()
    gltf.json["accessors"][0]["sparse"] = {
        "count": 1,
        "indices": {"bufferView": gltf.view(b"\x03\0\0\0"), "componentType": 5125},
        "values": {"bufferView": gltf.view(bytes(12))},
    }
    expected = "accessors[0].sparse.indices: index 3; the accessor has 3 elements"
    assert expected in message(gltf.write())


def test_a_joint_that_the_skin_lacks(message: Message, gltf: Any) -> None:
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
def test_no_uri_leads_out_of_the_folder(message: Message, gltf: Any, uri: str) -> None:
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


@pytest.mark.parametrize(
    ("limits", "expected"),
    [
        ({"file_bytes": 100}, "file: more than 100 bytes"),
        ({"mesh_bytes": 100}, "mesh_bytes: 180 and more; the limit is 100"),
        ({"nodes": 0}, "nodes: 1; the limit is 0"),
        ({"drawn_triangles": 0}, "instances: 1 triangles drawn; the limit is 0"),
    ],
)
def test_limits(message: Message, gltf: Any, limits: dict[str, int], expected: str) -> None:
    gltf.triangle()
    assert expected in message(gltf.write(), ResourceError, **limits)


def test_long_and_unprintable_names_do_not_flood_the_message(message: Message, gltf: Any) -> None:
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

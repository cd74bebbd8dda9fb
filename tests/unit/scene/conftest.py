"""Tiny glTF files built by hand, in temporary folders."""

import base64
import io
import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image as PillowImage

from lfd_render.errors import LfdError, SceneError
from lfd_render.scene import LoadLimits, Scene

COMPONENTS = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}

TRIANGLE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)


class GltfBuilder:
    """A glTF document that grows part by part; `json` may be bent at will before `write`."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.blob = bytearray()
        self.json: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "accessors": [],
            "bufferViews": [],
            "meshes": [],
            "nodes": [],
        }

    def view(self, data: bytes, **extra: int) -> int:
        """A buffer view over new bytes."""
        self.blob += b"\0" * (-len(self.blob) % 4)
        entry = {"buffer": 0, "byteOffset": len(self.blob), "byteLength": len(data), **extra}
        self.blob += data
        return self.append("bufferViews", entry)

    def accessor(self, values: NDArray[Any], *, stride: int = 0, **extra: Any) -> int:
        """An accessor over new bytes, [count] or [count, width], `stride` bytes apart if given."""
        rows = values.reshape(len(values), -1)
        data, options = rows.tobytes(), {}
        if stride:
            packed = rows.tobytes()
            element = len(packed) // len(rows)
            pieces = [packed[i * element : (i + 1) * element] for i in range(len(rows))]
            data = b"".join(piece.ljust(stride, b"\xcc") for piece in pieces)
            options["byteStride"] = stride
        return self.append(
            "accessors",
            {
                "bufferView": self.view(data, **options),
                "componentType": COMPONENTS[values.dtype.str[1:]],
                "count": len(rows),
                "type": TYPES[rows.shape[1]],
                **extra,
            },
        )

    def append(self, key: str, entry: dict[str, Any]) -> int:
        """Add an entry to a top-level list and return its index."""
        entries = self.json.setdefault(key, [])
        entries.append(entry)
        return len(entries) - 1

    def mesh(self, *primitives: dict[str, Any], **extra: Any) -> int:
        """A mesh of these primitives."""
        return self.append("meshes", {"primitives": list(primitives), **extra})

    def primitive(
        self, positions: NDArray[Any] = TRIANGLE, **attributes: NDArray[Any]
    ) -> dict[str, Any]:
        """A primitive with positions and other attributes by name."""
        named = {"POSITION": positions, **attributes}
        return {"attributes": {key: self.accessor(value) for key, value in named.items()}}

    def node(self, **fields: Any) -> int:
        """A node with these fields."""
        return self.append("nodes", fields)

    def triangle(self, **primitive: Any) -> int:
        """A node that draws one triangle."""
        return self.node(mesh=self.mesh({**self.primitive(), **primitive}))

    def texture(self, uri: str) -> dict[str, int]:
        """A texture info that shows the picture at a URI."""
        return {"index": self.append("textures", {"source": self.append("images", {"uri": uri})})}

    def text(self) -> str:
        """The document with its bytes as a data URI."""
        document = {k: v for k, v in self.json.items() if v != []}
        if self.blob and "buffers" not in document:
            uri = "data:application/octet-stream;base64," + base64.b64encode(self.blob).decode()
            document["buffers"] = [{"byteLength": len(self.blob), "uri": uri}]
        return json.dumps(document)

    def write(self, name: str = "scene.gltf") -> Path:
        """Write a .gltf file."""
        path = self.folder / name
        path.write_text(self.text(), encoding="utf-8")
        return path

    def write_glb(self, name: str = "scene.glb") -> Path:
        """Write a .glb file with the bytes in its binary chunk."""
        self.json["buffers"] = [{"byteLength": len(self.blob)}]
        text = self.text().encode()
        text += b" " * (-len(text) % 4)
        blob = bytes(self.blob) + b"\0" * (-len(self.blob) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text
        chunks += struct.pack("<I4s", len(blob), b"BIN\0") + blob
        path = self.folder / name
        path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
        return path


@pytest.fixture
def gltf(tmp_path: Path) -> GltfBuilder:
    """An empty document in an empty folder."""
    return GltfBuilder(tmp_path)


@pytest.fixture
def picture_bytes() -> Callable[..., bytes]:
    """``picture_bytes(pixels, "PNG")`` encodes an array."""

    def encode(pixels: NDArray[Any], kind: str = "PNG", **options: Any) -> bytes:
        stream = io.BytesIO()
        PillowImage.fromarray(pixels).save(stream, kind, **options)
        return stream.getvalue()

    return encode


@pytest.fixture
def message() -> Callable[..., str]:
    """``message(path, SceneError, nodes=3)``: what a bad scene's error says after its path.

    The general promises are checked on the way: the class, the file's name, one line, a remedy.
    """

    def load(path: Path | str, kind: type[LfdError] = SceneError, **limits: int) -> str:
        with pytest.raises(LfdError) as caught:
            Scene.load(path, LoadLimits(**limits) if limits else None)
        text = str(caught.value)
        assert type(caught.value) is kind
        assert text.startswith(f"{path}: ")
        assert text.isprintable()  # so it is one line
        assert ";" in text, "no remedy"
        return text.removeprefix(f"{path}: ")

    return load

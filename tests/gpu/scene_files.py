"""Scene files for tests: one textured ball, clean or spoilt, as glTF or OBJ with its pictures."""

import base64
import dataclasses
import io
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image as PillowImage

_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3"}


@dataclasses.dataclass
class Ball:
    """Corner arrays of a mesh, free to be spoilt before it is written; None leaves one out."""

    positions: NDArray[np.float64]
    normals: NDArray[np.float64] | None
    texcoords: NDArray[np.float64] | None
    triangles: NDArray[np.int64]
    node: dict[str, Any] = dataclasses.field(default_factory=dict)
    pictures: dict[str, bytes] = dataclasses.field(default_factory=dict)

    def write_gltf(self, folder: Path, copies: int = 1) -> Path:
        """A .gltf file with its bytes inside and its pictures beside it; `copies` materials, each
        for a like part of the triangles."""
        document: dict[str, Any] = {"asset": {"version": "2.0"}, "accessors": []}
        blob, views = bytearray(), []

        def accessor(values: NDArray[Any], component: int) -> int:
            views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": values.nbytes})
            blob.extend(values.tobytes())
            document["accessors"].append(
                {
                    "bufferView": len(views) - 1,
                    "componentType": component,
                    "count": len(values),
                    "type": _TYPES[values.reshape(len(values), -1).shape[1]],
                }
            )
            return len(views) - 1

        named = {"POSITION": self.positions, "NORMAL": self.normals, "TEXCOORD_0": self.texcoords}
        attributes = {
            key: accessor(_single(values), 5126)
            for key, values in named.items()
            if values is not None
        }
        document["meshes"] = [
            {
                "primitives": [
                    {
                        "attributes": attributes,
                        "indices": accessor(part.astype(np.uint32).ravel(), 5125),
                        "material": index,
                    }
                    for index, part in enumerate(np.array_split(self.triangles, copies))
                ]
            }
        ]
        names = self._write_pictures(folder)
        document["images"] = [{"uri": name} for name in names]
        document["textures"] = [{"source": index} for index in range(len(names))]
        material = {
            "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicFactor": 0.3},
            "normalTexture": {"index": 1},
        }
        document["materials"] = [{"name": f"ball {index}", **material} for index in range(copies)]
        document["nodes"] = [{"mesh": 0, **self.node}]
        document["bufferViews"] = views
        uri = "data:application/octet-stream;base64," + base64.b64encode(blob).decode()
        document["buffers"] = [{"byteLength": len(blob), "uri": uri}]
        path = folder / "ball.gltf"
        path.write_text(json.dumps(document), encoding="utf-8")
        return path

    def write_obj(self, folder: Path) -> Path:
        """An .obj file with its .mtl file and pictures beside it; the node's transform is lost."""
        lines = ["mtllib ball.mtl", "usemtl ball"]
        lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in self.positions.tolist()]
        if self.texcoords is not None:
            lines += [f"vt {u!r} {1.0 - v!r}" for u, v in self.texcoords.tolist()]
        if self.normals is not None:
            lines += [f"vn {x!r} {y!r} {z!r}" for x, y, z in self.normals.tolist()]
        texture = "{0}" if self.texcoords is not None else ""
        normal = "/{0}" if self.normals is not None else ""
        corner = "{0}" + (f"/{texture}{normal}" if texture or normal else "")
        for triangle in (self.triangles + 1).tolist():
            lines.append("f " + " ".join(corner.format(index) for index in triangle))
        base, bumps = self._write_pictures(folder)
        statements = ["newmtl ball", f"map_Kd {base}", f"norm {bumps}", "Pr 0.5", "Pm 0.3"]
        (folder / "ball.mtl").write_text("\n".join(statements), encoding="utf-8")
        path = folder / "ball.obj"
        path.write_text("\n".join(lines), encoding="utf-8")
        return path

    def _write_pictures(self, folder: Path) -> list[str]:
        for name, data in self.pictures.items():
            (folder / name).write_bytes(data)
        return list(self.pictures)


def ball(columns: int = 24, rows: int = 12) -> Ball:
    """A sphere of radius 1 with normals, texture coordinates, a base colour and a normal map."""
    v, u = np.mgrid[: rows + 1, : columns + 1] / np.array([rows, columns])[:, None, None]
    turn, tilt = 2.0 * np.pi * u, np.pi * v
    points = [np.sin(tilt) * np.cos(turn), np.cos(tilt), -np.sin(tilt) * np.sin(turn)]
    positions = np.stack(points, axis=-1).reshape(-1, 3)
    corner = np.arange((rows + 1) * (columns + 1)).reshape(rows + 1, columns + 1)
    a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
    quads = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
    whole = positions[quads]
    area = np.cross(whole[:, 1] - whole[:, 0], whole[:, 2] - whole[:, 0])
    return Ball(
        positions,
        positions.copy(),
        np.stack([u, v], axis=-1).reshape(-1, 2),
        quads[np.linalg.norm(area, axis=1) > 1e-9],  # the poles' quads are triangles
        pictures={"base.png": _picture(1), "bumps.png": _picture(2, bumps=True)},
    )


def _single(values: NDArray[np.float64]) -> NDArray[np.float32]:
    with np.errstate(over="ignore"):
        return values.astype(np.float32)


def _picture(seed: int, *, bumps: bool = False) -> bytes:
    rng = np.random.default_rng(seed)
    pixels = rng.integers(60, 256, (32, 64, 3)).astype(np.uint8)
    if bumps:
        pixels = np.concatenate([rng.integers(90, 166, (32, 64, 2)), np.full((32, 64, 1), 240)], 2)
    stream = io.BytesIO()
    PillowImage.fromarray(pixels.astype(np.uint8)).save(stream, "png")
    return stream.getvalue()

"""Accessors of a glTF file as numpy arrays: bounds checked, views where the layout allows.

glTF 2.0, section 3.6. Every byte range is checked against what is really there before use.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfd_render.errors import SceneError
from lfd_render.scene.fields import Fields
from lfd_render.scene.gltf_document import Document

_COMPONENTS: dict[int, np.dtype[Any]] = {
    5120: np.dtype("i1"),
    5121: np.dtype("u1"),
    5122: np.dtype("<i2"),
    5123: np.dtype("<u2"),
    5125: np.dtype("<u4"),
    5126: np.dtype("<f4"),
}
_INDEX_COMPONENTS = (5121, 5123, 5125)
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
_MAX_WITHOUT_BYTES = 1 << 24  # elements of an accessor whose zeros the file does not hold


class Accessors:
    """Reads the accessors of one document; results are kept, callers must not write to them."""

    def __init__(self, document: Document) -> None:
        self._document = document
        self._buffers: dict[int, memoryview] = {}
        self._raw: dict[int, NDArray[Any]] = {}
        self._floats: dict[tuple[int, bool], NDArray[np.float32]] = {}

    def indices(self, index: int) -> NDArray[np.uint32]:
        """A scalar accessor of unsigned integers, [count]."""
        fields = self._document.accessors[index]
        if fields.integer("componentType") not in _INDEX_COMPONENTS:
            fields.fail("componentType", "indices are 5121, 5123 or 5125")
        return self._read(index, ("SCALAR",))[:, 0].astype(np.uint32, copy=False)

    def floats(
        self, index: int, types: Sequence[str], normalized: bool = False
    ) -> NDArray[np.float32]:
        """An accessor as [count, width] float32; integers are normalised if it or the caller says.

        Normalisation as in glTF 2.0, section 3.11: c / max, signed ones not below −1.
        """
        fields = self._document.accessors[index]
        normalized = normalized or fields.flag("normalized")
        raw = self._read(index, types)
        key = (index, normalized)
        if key not in self._floats:
            values = raw.astype(np.float32, copy=False)
            if normalized and raw.dtype.kind in "iu":
                values = values / np.float32(np.iinfo(raw.dtype).max)
                if raw.dtype.kind == "i":
                    np.maximum(values, np.float32(-1.0), out=values)
            self._floats[key] = values
        return self._floats[key]

    def integers(self, index: int, types: Sequence[str]) -> NDArray[np.int64]:
        """An accessor of integers as [count, width]."""
        raw = self._read(index, types)
        if raw.dtype.kind not in "iu":
            self._document.accessors[index].fail("componentType", "give an integer type")
        return raw.astype(np.int64)

    def view_bytes(self, index: int) -> memoryview:
        """All bytes of a buffer view."""
        fields = self._document.buffer_views[index]
        buffer_index = fields.index("buffer", len(self._document.buffers))
        if buffer_index is None:
            fields.fail("buffer", "give the index of a buffer")
        data = self._buffer(buffer_index)
        start = fields.integer("byteOffset", 0)
        length = fields.integer("byteLength", low=1)
        if start + length > len(data):
            raise SceneError(
                f"{fields.path}: bytes {start} to {start + length}, buffer {buffer_index} has "
                f"{len(data)}; give offsets inside the buffer"
            )
        return data[start : start + length]

    def _buffer(self, index: int) -> memoryview:
        if index not in self._buffers:
            fields = self._document.buffers[index]
            length = fields.integer("byteLength", low=1)
            data = self._buffer_bytes(index, fields)
            if len(data) < length:
                fields.fail("byteLength", f"there are only {len(data)} bytes, fetch the file anew")
            self._buffers[index] = data[:length]
        return self._buffers[index]

    def _buffer_bytes(self, index: int, fields: Fields) -> memoryview:
        if "uri" in fields:
            return memoryview(self._document.files.read(fields.text("uri"), fields.place("uri")))
        if index > 0 or self._document.binary_chunk is None:
            fields.fail("uri", "only the first buffer of a GLB with a binary chunk does without")
        return self._document.binary_chunk

    def _read(self, index: int, types: Sequence[str]) -> NDArray[Any]:
        """Components as stored, [count, width], of one of the allowed types."""
        fields = self._document.accessors[index]
        kind = fields.choice("type", tuple(_WIDTHS))
        if kind not in types:
            fields.fail("type", f"give {' or '.join(types)} here")
        if index not in self._raw:
            self._raw[index] = self._read_fields(fields, _WIDTHS[kind])
        return self._raw[index]

    def _read_fields(self, fields: Fields, width: int) -> NDArray[Any]:
        dtype = _component(fields, tuple(_COMPONENTS))
        count = fields.integer("count", low=1)
        view_index = fields.index("bufferView", len(self._document.buffer_views))
        if view_index is not None:
            values = self._strided(fields, view_index, dtype, count, width)
        elif count > _MAX_WITHOUT_BYTES:
            fields.fail("count", "the accessor has no bufferView that could hold so many")
        else:
            values = np.zeros((count, width), dtype)
        sparse = fields.optional("sparse")
        return values if sparse is None else self._with_sparse(values, sparse)

    def _strided(
        self, fields: Fields, view_index: int, dtype: np.dtype[Any], count: int, width: int
    ) -> NDArray[Any]:
        """A view of [count, width] components, `byteStride` apart, inside a buffer view."""
        element = dtype.itemsize * width
        stride = self._document.buffer_views[view_index].integer("byteStride", element, high=252)
        if stride < element:
            self._document.buffer_views[view_index].fail(
                "byteStride", f"an element of {fields.path} takes {element} bytes"
            )
        data = self.view_bytes(view_index)
        start = fields.integer("byteOffset", 0)
        needed = start + (count - 1) * stride + element
        if needed > len(data):
            fields.fail("count", f"needs {needed} bytes, bufferViews[{view_index}] has {len(data)}")
        return np.ndarray((count, width), dtype, data, start, (stride, dtype.itemsize))

    def _with_sparse(self, values: NDArray[Any], sparse: Fields) -> NDArray[Any]:
        """A copy with some elements replaced (glTF 2.0, section 3.6.2.3)."""
        count = sparse.integer("count", low=1, high=len(values))
        places = sparse.child("indices")
        rows = self._strided(
            places, self._view_of(places), _component(places, _INDEX_COMPONENTS), count, 1
        )[:, 0]
        if int(rows.max()) >= len(values):
            raise SceneError(
                f"{places.path}: index {int(rows.max())}; the accessor has {len(values)} elements"
            )
        replacing = sparse.child("values")
        out = values.copy()
        out[rows] = self._strided(
            replacing, self._view_of(replacing), values.dtype, count, values.shape[1]
        )
        return out

    def _view_of(self, fields: Fields) -> int:
        index = fields.index("bufferView", len(self._document.buffer_views))
        if index is None:
            fields.fail("bufferView", "give the index of a buffer view")
        return index


def _component(fields: Fields, allowed: Sequence[int]) -> np.dtype[Any]:
    code = fields.integer("componentType")
    if code not in allowed:
        fields.fail("componentType", f"give one of {', '.join(map(str, allowed))}")
    return _COMPONENTS[code]

"""The vertex attributes of one glTF primitive, checked against each other, unused ones dropped."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lfd_render.scene.deform import MOST_TARGETS, Influences, Morph
from lfd_render.scene.fields import Fields
from lfd_render.scene.gltf_accessors import Accessors
from lfd_render.scene.gltf_document import Document


class Vertices:
    """The attributes of one primitive, each with as many elements as POSITION."""

    def __init__(self, primitive: Fields, accessors: Accessors, document: Document) -> None:
        self._primitive = primitive
        self._attributes = primitive.child("attributes")
        self._targets = primitive.children("targets")
        self._accessors = accessors
        self._document = document
        self._used: NDArray[np.int64] | None = None
        if "POSITION" not in self._attributes:
            self._attributes.fail("POSITION", "give vertex positions")
        # Read at once: only a read proves that as many vertices as the count says are there.
        position = self._index(self._attributes, "POSITION")
        self._file_count = len(accessors.floats(position, ("VEC3",)))

    @property
    def count(self) -> int:
        """Vertices of the mesh; before keep_used, of the file."""
        return self._file_count if self._used is None else len(self._used)

    def has(self, name: str) -> bool:
        """Whether the primitive has an attribute."""
        return name in self._attributes

    def keep_used(self, triangles: NDArray[np.uint32]) -> NDArray[np.uint32]:
        """Drop vertices that no triangle uses; returns the triangles renumbered.

        Exporters share one large vertex buffer between many primitives; without this each of
        them would hold it whole.
        """
        if triangles.size < self._file_count:
            used, inverse = np.unique(triangles, return_inverse=True)
            self._used = used.astype(np.int64)
            return inverse.reshape(-1, 3).astype(np.uint32)
        touched = np.zeros(self._file_count, bool)
        touched[triangles] = True
        if touched.all():
            return triangles
        self._used = np.flatnonzero(touched)
        renumbered = np.cumsum(touched, dtype=np.uint32) - np.uint32(1)
        return renumbered[triangles]

    def vectors(self, name: str) -> NDArray[np.float32]:
        """POSITION or NORMAL, [n, 3]."""
        return self._floats(self._attributes, name, ("VEC3",))

    @property
    def target_count(self) -> int:
        """Morph targets of the primitive."""
        return len(self._targets)

    def morph(self) -> Morph | None:
        """The displacements of the morph targets, zero where a target has none; None without."""
        if not self._targets:
            return None
        if len(self._targets) > MOST_TARGETS:
            self._primitive.fail("targets", f"give at most {MOST_TARGETS} targets")
        shape = (len(self._targets), self.count, 3)
        displacements = {}
        for name in ("POSITION", "NORMAL"):
            has = any(name in target for target in self._targets)
            values = np.zeros(shape, np.float32) if has else np.broadcast_to(np.float32(0), shape)
            for row, target in zip(values, self._targets, strict=True):
                if name in target:
                    row[:] = self._floats(target, name, ("VEC3",))
            displacements[name] = values
        return Morph(displacements["POSITION"], displacements["NORMAL"])

    def texcoords(self) -> NDArray[np.float32]:
        """Both coordinate sets, [n, 2, 2] as [vertex, set, uv], zero where absent."""
        out = np.zeros((self.count, 2, 2), np.float32)
        for number, name in enumerate(("TEXCOORD_0", "TEXCOORD_1")):
            if self.has(name):
                out[:, number] = self._floats(self._attributes, name, ("VEC2",))
        return out

    def colors(self) -> NDArray[np.float32]:
        """Linear vertex colours, [n, 4], white where absent."""
        out = np.ones((self.count, 4), np.float32)
        if self.has("COLOR_0"):
            values = self._floats(self._attributes, "COLOR_0", ("VEC3", "VEC4"), normalized=True)
            out[:, : values.shape[1]] = values
        return out

    def influences(self, joint_count: int) -> Influences | None:
        """The joints and weights of all sets, of a skin of so many joints; None, with a warning,
        where there are none."""
        joints: list[NDArray[np.int64]] = []
        weights: list[NDArray[np.float32]] = []
        while self.has(f"JOINTS_{len(joints)}") and self.has(f"WEIGHTS_{len(joints)}"):
            key = f"JOINTS_{len(joints)}"
            values = self._accessors.integers(self._index(self._attributes, key), ("VEC4",))
            self._check_count(self._attributes, key, len(values))
            values = values if self._used is None else values[self._used]
            if int(values.max()) >= joint_count:
                self._attributes.fail(
                    key, f"joint {int(values.max())} is named, the skin has {joint_count}"
                )
            key = f"WEIGHTS_{len(joints)}"
            weights.append(self._floats(self._attributes, key, ("VEC4",), normalized=True))
            joints.append(values)
        if not joints:
            self._document.warn(f"{self._primitive.path}: skinned without JOINTS_0 and WEIGHTS_0")
            return None
        return Influences.scaled(np.concatenate(joints, axis=1), np.concatenate(weights, axis=1))

    def _floats(
        self, owner: Fields, name: str, types: Sequence[str], normalized: bool = False
    ) -> NDArray[np.float32]:
        values = self._accessors.floats(self._index(owner, name), types, normalized)
        self._check_count(owner, name, len(values))
        return values if self._used is None else values[self._used]

    def _check_count(self, owner: Fields, name: str, count: int) -> None:
        if count != self._file_count:
            owner.fail(name, f"the accessor has {count} elements, POSITION {self._file_count}")

    def _index(self, owner: Fields, name: str) -> int:
        index = owner.index(name, len(self._document.accessors))
        if index is None:
            owner.fail(name, "give the index of an accessor")
        return index

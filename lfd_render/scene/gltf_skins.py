"""Skins of a glTF file (glTF 2.0, section 3.7.3)."""

from __future__ import annotations

import numpy as np

from lfd_render.scene.deform import Skin
from lfd_render.scene.gltf_accessors import Accessors
from lfd_render.scene.gltf_document import Document


def read_skins(document: Document, accessors: Accessors) -> tuple[Skin, ...]:
    """All skins of the file, in its order. Raises SceneError with the field and the remedy."""
    skins = []
    for number, fields in enumerate(document.skins):
        joints = fields.indices("joints", len(document.nodes))
        if not joints:
            fields.fail("joints", "give at least one joint")
        joint_from_bind = np.tile(np.eye(4), (len(joints), 1, 1))
        index = fields.index("inverseBindMatrices", len(document.accessors))
        if index is not None:
            matrices = accessors.floats(index, ("MAT4",))
            if len(matrices) < len(joints):
                fields.fail("inverseBindMatrices", f"give {len(joints)} matrices, one a joint")
            # The file stores columns one after the other; the last row says nothing.
            columns = matrices[: len(joints)].reshape(-1, 4, 4).astype(np.float64)
            joint_from_bind[:, :3] = columns.transpose(0, 2, 1)[:, :3]
        name = fields.text("name", f"skin {number}")
        skins.append(Skin(name, np.array(joints, np.int64), joint_from_bind))
    return tuple(skins)

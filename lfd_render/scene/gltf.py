"""glTF 2.0 files, `.gltf` and `.glb`, as scenes.

Nodes, skins and morph targets are kept, so that poses move them. Animations are not played; points,
lines and orthographic cameras are left out; each of these gives a warning.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lfd_render.errors import ResourceError
from lfd_render.scene.files import SceneFiles
from lfd_render.scene.gltf_accessors import Accessors
from lfd_render.scene.gltf_document import Document
from lfd_render.scene.gltf_lights import read_lights
from lfd_render.scene.gltf_materials import Materials
from lfd_render.scene.gltf_meshes import Meshes
from lfd_render.scene.gltf_nodes import NodeTree
from lfd_render.scene.gltf_skins import read_skins
from lfd_render.scene.limits import Budget, LoadLimits
from lfd_render.scene.model import Instance, Scene


def load_gltf(path: Path, limits: LoadLimits) -> Scene:
    """Read a glTF file and the files beside it.

    Raises SceneError or ResourceError with the field, its value and the remedy.
    """
    document = Document(SceneFiles(path, limits), Budget(limits))
    accessors = Accessors(document)
    tree = NodeTree(document)
    materials = Materials(document, accessors)
    skins = read_skins(document, accessors)
    meshes = Meshes(document, accessors, materials, skins)
    instances = _instances(document, tree, meshes)
    if document.root.children("animations"):
        document.warn("animations: not played; the scene stands in its rest pose")
    return Scene(
        name=path.stem,
        meshes=tuple(meshes.meshes),
        instances=tuple(instances),
        materials=materials.materials(),
        images=materials.decode() if instances else (),
        cameras=tree.cameras(),
        lights=read_lights(document, tree),
        warnings=document.warnings,
        nodes=tree.nodes,
        skins=skins,
    )


def _instances(document: Document, tree: NodeTree, meshes: Meshes) -> list[Instance]:
    instances: list[Instance] = []
    limit = document.budget.limits.nodes
    moving = bool(document.root.children("animations"))
    for node in tree.drawn():
        fields = document.nodes[node]
        mesh_index = fields.index("mesh", len(document.meshes))
        if mesh_index is None:
            continue
        world_from_local = tree.world_from_node[node]
        # What is flat at rest may grow where nodes move.
        flat = not moving and np.linalg.matrix_rank(world_from_local[:3, :3]) < 2
        if flat and "skin" not in fields:
            document.warn(f"{fields.path}: scaled to a line or a point and left out")
            continue
        for mesh, weights in meshes.place(mesh_index, fields):
            skin = fields.index("skin", len(document.skins))
            skin = None if meshes.meshes[mesh].influences is None else skin
            # A skinned mesh comes from its joints into the world; its node's transform is ignored.
            matrix = world_from_local if skin is None else np.eye(4)
            name = tree.nodes.names[node]
            instances.append(Instance(name, mesh, matrix, node, skin, weights))
        if len(instances) > limit:
            raise ResourceError(f"nodes: more than {limit} instances; give a smaller scene")
    return instances

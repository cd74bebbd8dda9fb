"""Lights of a glTF file: KHR_lights_punctual."""

from __future__ import annotations

import math

import numpy as np

from lfd_render.errors import ResourceError
from lfd_render.scene.fields import Fields
from lfd_render.scene.gltf_document import Document
from lfd_render.scene.gltf_nodes import NodeTree
from lfd_render.scene.limits import MOST_LIGHTS
from lfd_render.scene.model import LIGHT_KINDS, Light

_EXTENSION = "KHR_lights_punctual"


def read_lights(document: Document, tree: NodeTree) -> tuple[Light, ...]:
    """Lights of the drawn nodes, each by its node's world transform.

    Raises SceneError with the field, its value and the remedy, ResourceError for too many.
    """
    extension = document.root.extension(_EXTENSION)
    kinds = extension.children("lights") if extension else []
    limit = min(document.budget.limits.lights, MOST_LIGHTS)
    lights: list[Light] = []
    for node in tree.drawn():
        use = document.nodes[node].extension(_EXTENSION)
        if use is None:
            continue
        index = use.index("light", len(kinds))
        if index is None:
            use.fail("light", "give the index of a light")
        world_from_node = tree.world_from_node[node]
        if not np.any(world_from_node[:3, 2]):
            document.warn(f"{use.path}: scaled to nothing along its −z and left out")
            continue
        lights.append(_light(kinds[index], f"light {index}", world_from_node, node))
        if len(lights) > limit:
            raise ResourceError(f"{_EXTENSION}: more than {limit} lights; give a scene of fewer")
    return tuple(lights)


def _light(fields: Fields, name: str, world_from_light: np.ndarray, node: int) -> Light:
    kind = fields.choice("type", LIGHT_KINDS)
    red, green, blue = fields.numbers("color", (1.0, 1.0, 1.0), low=0.0)
    reach = fields.number("range", low=0.0) if "range" in fields else None
    if reach == 0.0:
        fields.fail("range", "give a number above 0, or leave it out")
    inner, outer = _cones(fields.child("spot")) if kind == "spot" else (0.0, math.pi / 4)
    return Light(
        name=fields.text("name", name),
        kind=kind,
        world_from_light=world_from_light,
        color=(red, green, blue),
        intensity=fields.number("intensity", 1.0, low=0.0),
        range=reach,
        inner_cone_rad=inner,
        outer_cone_rad=outer,
        node=node,
    )


def _cones(spot: Fields) -> tuple[float, float]:
    """Inner and outer angle from the axis, 0 ≤ inner < outer ≤ π/2."""
    # Files write π/2 with float32's rounding, or a few digits.
    outer = min(spot.number("outerConeAngle", math.pi / 4, low=0.0, high=1.5709), math.pi / 2)
    inner = spot.number("innerConeAngle", 0.0, low=0.0)
    if not inner < outer:
        spot.fail("innerConeAngle", f"give an angle from 0 to below outerConeAngle, {outer:g}")
    return inner, outer

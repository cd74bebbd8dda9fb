"""Lights of glTF files (KHR_lights_punctual), and the exposure that they suggest."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from lfd_render.errors import ResourceError, SceneError
from lfd_render.scene import Light, Scene
from lfd_render.scene.exposure import exposure_hint, white_under_lights

NAME = "KHR_lights_punctual"


def lit(gltf: Any, *lights: dict[str, Any], **node: Any) -> None:
    """A triangle, and a node for each light with the same transform."""
    gltf.triangle()
    gltf.json["extensionsUsed"] = gltf.json["extensionsRequired"] = [NAME]
    gltf.json["extensions"] = {NAME: {"lights": list(lights)}}
    for index in range(len(lights)):
        gltf.node(extensions={NAME: {"light": index}}, **node)


def test_all_kinds(gltf: Any) -> None:
    lit(
        gltf,
        {"type": "directional", "intensity": 30000, "color": [1, 0.5, 0]},
        {"type": "point", "name": "lamp", "range": 4.5, "intensity": 80},
        {"type": "spot", "spot": {"innerConeAngle": 0.25, "outerConeAngle": 0.5}},
        {"type": "spot", "spot": {}},
        translation=[1, 2, 3],
        rotation=[math.sqrt(0.5), 0, 0, math.sqrt(0.5)],
        scale=[2, 2, 2],
    )
    scene = Scene.load(gltf.write())
    sun, lamp, spot, plain = scene.lights
    assert scene.warnings == ()
    assert (sun.kind, sun.intensity, sun.color, sun.range) == (
        "directional",
        30000,
        (1, 0.5, 0),
        None,
    )
    assert (lamp.kind, lamp.name, lamp.range, lamp.color) == ("point", "lamp", 4.5, (1, 1, 1))
    assert (spot.inner_cone_rad, spot.outer_cone_rad, spot.intensity) == (0.25, 0.5, 1)
    assert (plain.inner_cone_rad, plain.outer_cone_rad) == (0, math.pi / 4)
    # A quarter turn about x takes −z to +y; the scale lengthens the axis and nothing else.
    np.testing.assert_allclose(-sun.world_from_light[:3, 2], [0, 2, 0], atol=1e-12)
    np.testing.assert_allclose(lamp.world_from_light[:3, 3], [1, 2, 3])


def test_lights_of_nodes_that_are_not_drawn_are_left_out(gltf: Any) -> None:
    lit(gltf, {"type": "point"}, {"type": "oval"})
    gltf.json["scenes"] = [{"nodes": [0, 1]}]
    assert len(Scene.load(gltf.write()).lights) == 1


def test_a_light_that_is_scaled_away(gltf: Any) -> None:
    lit(gltf, {"type": "spot", "spot": {}}, scale=[1, 1, 0])
    scene = Scene.load(gltf.write())
    assert scene.lights == ()
    assert scene.warnings == (
        f"nodes[1].extensions.{NAME}: scaled to nothing along its −z and left out",
    )


@pytest.mark.parametrize(
    ("light", "expected"),
    [
        ({}, "lights[0].type: missing; give one of directional, point, spot"),
        ({"type": "area"}, "lights[0].type: 'area'; give one of directional"),
        (
            {"type": "point", "intensity": -1},
            "lights[0].intensity: -1; give a finite number from 0",
        ),
        ({"type": "point", "intensity": "1"}, "lights[0].intensity: '1'"),
        ({"type": "point", "color": [1, 1]}, "lights[0].color: [1, 1]; give 3 finite numbers"),
        ({"type": "point", "color": [1, -1, 0]}, "lights[0].color: [1, -1, 0]"),
        ({"type": "point", "range": 0}, "lights[0].range: 0; give a number above 0"),
        ({"type": "point", "range": -2}, "lights[0].range: -2"),
        ({"type": "point", "name": 3}, "lights[0].name: 3"),
        ({"type": "spot"}, "lights[0].spot: missing; give a JSON object"),
        ({"type": "spot", "spot": {"outerConeAngle": 2}}, "spot.outerConeAngle: 2"),
        ({"type": "spot", "spot": {"outerConeAngle": 0}}, "spot.innerConeAngle: missing; give"),
        ({"type": "spot", "spot": {"innerConeAngle": 1}}, "spot.innerConeAngle: 1; give an angle"),
        ({"type": "spot", "spot": {"innerConeAngle": -1}}, "spot.innerConeAngle: -1"),
    ],
)
def test_bad_lights(
    message: Callable[..., str], gltf: Any, light: dict[str, Any], expected: str
) -> None:
    lit(gltf, light)
    assert expected in message(gltf.write())


@pytest.mark.parametrize(
    ("use", "expected"),
    [
        ({"light": 1}, "light: 1; give an index from 0 to 0"),
        ({"light": -1}, "light: -1"),
        ({}, "light: missing; give the index of a light"),
        (0, f"{NAME}: 0; give a JSON object"),
    ],
)
def test_bad_references(message: Callable[..., str], gltf: Any, use: Any, expected: str) -> None:
    lit(gltf, {"type": "point"})
    gltf.json["nodes"][1]["extensions"][NAME] = use
    assert expected in message(gltf.write())


def test_more_lights_than_allowed(message: Callable[..., str], gltf: Any) -> None:
    lit(gltf, *[{"type": "point"}] * 3)
    assert len(Scene.load(gltf.write()).lights) == 3
    assert "more than 2 lights" in message(gltf.write(), ResourceError, lights=2)
    for _ in range(300):  # nodes may share a light
        gltf.node(extensions={NAME: {"light": 0}})
    assert "more than 256 lights" in message(gltf.write(), ResourceError)


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({"kind": "area"}, "kind: 'area'"),
        ({"intensity": -1.0}, "intensity -1.0"),
        ({"intensity": math.inf}, "intensity inf"),
        ({"color": (1.0, math.nan, 0.0)}, "give finite numbers"),
        ({"range": 0.0}, "range: 0.0"),
        ({"inner_cone_rad": 0.5, "outer_cone_rad": 0.5}, "cones 0.5, 0.5"),
        ({"outer_cone_rad": 1.6}, "cones 0.0, 1.6"),
        ({"world_from_light": np.diag([1.0, 1, 0, 1])}, "its −z has no length"),
        ({"world_from_light": np.eye(3)}, "world_from_light"),
    ],
)
def test_lights_check_themselves(options: dict[str, Any], expected: str) -> None:
    with pytest.raises(SceneError, match="light 'l': ") as caught:
        Light(**{"name": "l", "kind": "spot", "world_from_light": np.eye(4), **options})
    assert expected in str(caught.value)


# ---- exposure ---------------------------------------------------------------------------------


def test_lights_of_thousands_of_candela_suggest_an_exposure(gltf: Any) -> None:
    """The triangle's box is 1 × 1 × 0 about (½, ½, 0); the lamp hangs 5 before its middle."""
    lit(gltf, {"type": "point", "intensity": 54351.0}, translation=[0.5, 0.5, 5])
    scene = Scene.load(gltf.write())
    white = 54351.0 / 25.0 / math.pi
    assert white_under_lights(scene) == pytest.approx(white)
    stops = math.log2(white)
    hint = exposure_hint(scene)
    assert hint is not None
    assert hint.endswith(f"try --exposure -{round(2 * stops) / 2:g}EV")


def test_modest_lights_suggest_nothing(gltf: Any) -> None:
    lit(gltf, {"type": "directional", "intensity": 3.0}, {"type": "point", "intensity": 0.2})
    scene = Scene.load(gltf.write())
    # The lamp stands outside half the radius, √½/2 of the box, √½ from its middle.
    assert white_under_lights(scene) == pytest.approx((3.0 + 0.2 / 0.5) / math.pi)
    assert exposure_hint(scene) is None

"""The study of LFDPR's ideas: what it must show on a small scene, and its copies of a scene."""

import json

import numpy as np
import pytest

from lfd_render.bench import features
from lfd_render.bench.features import BASE, VARIANTS, Result, copies, main, table
from lfd_render.scene import Scene

pytestmark = pytest.mark.needs("gl")


TRIED = (BASE, "no texture limit", "shade by rays", "lattice paper", "lod none", "mvr")


def test_ideas_that_change_no_pixel_change_none(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of six variants, since each compiles its own shaders."""
    monkeypatch.setattr(features, "VARIANTS", {name: VARIANTS[name] for name in TRIED})
    few = [
        "--view-size",
        "60x45",
        "--views",
        "3",
        "--compared",
        "2",
        "--samples",
        "2",
        "--rounds",
        "1",
    ]
    assert main(["builtin:spheres?triangles=2000", *few, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    results = {row["variant"]: Result(**row) for row in found["variants"]}
    assert tuple(results) == TRIED
    base = results[BASE]
    for name, other in (("no texture limit", BASE), ("lattice paper", "shade by rays")):
        alike = results[other]
        assert (results[name].rmse, results[name].visible) == (alike.rmse, alike.visible)
    assert results["no texture limit"].points > 1.2 * base.points
    assert results["lattice paper"].pairs_per_pixel > base.pairs_per_pixel
    assert results["lod none"].rmse > base.rmse
    assert results["mvr"].points is None
    lines = table(list(results.values())).splitlines()
    assert len(lines) == 2 + len(TRIED)
    assert all(line.count("|") == 8 for line in lines)


def test_copies_stand_side_by_side() -> None:
    scene = Scene.load("builtin:spheres?triangles=2000")
    many = copies(scene, 5)
    assert many.triangle_count == 5 * scene.triangle_count
    first = many.instances[:: len(scene.instances)]
    assert len({tuple(i.world_from_local[:3, 3].round(3)) for i in first}) == 5
    size, larger = (np.ptp(s.bounds(), axis=0) for s in (scene, many))
    assert larger[0] > 2.5 * size[0]


def test_the_command_says_what_is_wrong(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["builtin:spheres*many"]) == 1
    assert "copies 'many'; use a whole number from 1 to 1000" in capsys.readouterr().err
    assert main(["builtin:nothing"]) == 1

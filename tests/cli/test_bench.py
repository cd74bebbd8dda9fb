"""`lfd-render bench` with a bench that measures nothing: files, going on, Ctrl-C, bad options."""

import json
from pathlib import Path

import pytest

from lfd_render.bench.measure import Bench
from lfd_render.bench.row import Row
from lfd_render.bench.suites import Group
from lfd_render.errors import SceneError

from .conftest import Command

pytestmark = pytest.mark.needs("gl")
SMALL = ("--suite", "aa", "--scene", "builtin:car", "--scene", "builtin:atrium",
         "--technique", "lfdpr", "--technique", "mvr", "--aa", "none")  # fmt: skip


def measured(group: Group) -> list[Row]:
    return [
        Row(
            group=group.key, suites=suites, scene=group.scene, triangles=1000, views=48,
            supersample=(1, 1), contender=c.name, technique=c.technique, aa=c.aa,
            frames_ms=[90.0 if c.rasterises else 30.0] * 3,
        )
        for c, suites in group.contenders.items()
    ]  # fmt: skip


def test_results_are_written_and_gone_on_with(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[str] = []

    def rows(self: Bench, group: Group) -> list[Row]:
        asked.append(group.scene)
        if len(asked) == 2:
            raise KeyboardInterrupt
        return measured(group)

    monkeypatch.setattr(Bench, "rows", rows)
    folder = tmp_path / "bench"
    result = command("bench", folder, *SMALL)
    assert result.code == 130
    assert "1 groups of 2, 1 groups still to do; the same command goes on" in result.stderr
    assert "| 3.00 × |" in (folder / "tables.md").read_text()
    result = command("bench", folder, *SMALL, "--json")
    assert result.code == 0
    assert asked == ["builtin:car", "builtin:atrium", "builtin:atrium"]
    ratios = [row["ratio"] for row in result.json["rows"]]
    assert ratios == [3.0, 1.0] * 2
    assert json.loads((folder / "results.json").read_text())["rows"] == result.json["rows"]
    result = command("bench", folder, "--against", folder, "--json")
    assert [r["differ"] for r in result.json["ratios"]] == [0.0] * 2


def test_a_scene_that_fails_leaves_the_rest(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def rows(self: Bench, group: Group) -> list[Row]:
        if "car" in group.scene:
            raise SceneError("too large for this machine")
        return measured(group)

    monkeypatch.setattr(Bench, "rows", rows)
    result = command("bench", tmp_path / "bench", *SMALL)
    assert result.code == 0
    assert (
        "Missing: lfdpr, mvr:multipass: too large for this machine (builtin:car)" in result.stdout
    )
    assert "| 3.00 × |" in result.stdout
    assert "1 groups of 2, 1 groups still to do" in result.stderr
    monkeypatch.setattr(Bench, "rows", lambda self, group: measured(group))
    result = command("bench", tmp_path / "bench", *SMALL)  # what failed is tried again
    assert "Missing" not in result.stdout
    assert "2 groups of 2" in result.stderr


def test_other_settings_and_bad_options_are_named(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Bench, "rows", lambda self, group: measured(group))
    folder = tmp_path / "bench"
    assert command("bench", folder, *SMALL).code == 0
    result = command("bench", folder, *SMALL, "--rounds", 4)
    assert result.code == 2
    assert "was measured with effort.rounds 15, not 4" in result.error
    for arguments, message in (
        (("--technique", "epr"), "technique 'epr': unknown"),
        (("--suite", "all"), "suite 'all': unknown"),
        (("--scene-triangles", 5), "scene 'builtin:atrium?triangles=5': triangles: '5'; give"),
        (("--supersample", "zero"), "zero"),
        (("--gold-size", "large"), "--gold-size"),
    ):
        result = command("bench", tmp_path / "other", *arguments)
        assert result.code in (2, 3)
        assert message in result.error
        assert not (tmp_path / "other").exists()


def test_the_best_of_the_ranking_is_narrowed_by_the_filters_table(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ms = {"mvr:loop-4-deferred": 40.0, "mvr:multipass-deferred": 45.0}
    asked: list[set[str]] = []

    def rows(self: Bench, group: Group) -> list[Row]:
        asked.append({c.technique for c in group.contenders if c.rasterises})
        found = measured(group)
        for row in found:
            row.frames_ms = [ms.get(row.technique, 90.0)] * 3
        return found

    monkeypatch.setattr(Bench, "rows", rows)
    options = ("--suite", "aa", "--suite", "views", "--scene", "builtin:car", "--aa", "none",
               "--technique", "lfdpr", "--technique", "mvr:best", "--views", 96)  # fmt: skip
    assert command("bench", tmp_path / "bench", *options).code == 0
    ranking, filters, *views = asked
    assert ranking > set(ms)
    assert filters == set(ms)  # within a quarter of each other
    assert views == [{"mvr:loop-4-deferred"}] * 2  # more than a twentieth apart

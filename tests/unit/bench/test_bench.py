"""What the bench does without a device: names, groups, checks of pictures, files, tables, plots."""

import dataclasses
import json
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lfd_render.bench import rivals
from lfd_render.bench.against import compare, table
from lfd_render.bench.applications import differ
from lfd_render.bench.check import Verdict, against_peers, detail_share, stray_view
from lfd_render.bench.contenders import USUAL, Contender, fastest, techniques
from lfd_render.bench.estimate import Progress, span
from lfd_render.bench.measure import Effort
from lfd_render.bench.papers import TABLE_1, TABLE_2
from lfd_render.bench.plots import write_plots
from lfd_render.bench.results import LINES, Results, read_groups
from lfd_render.bench.row import Row, best_mvr
from lfd_render.bench.suites import SUITES, Axes, groups_of, scene_source
from lfd_render.bench.tables import report
from lfd_render.display import DisplayProfile, Rig
from lfd_render.errors import GpuError, OutputError, UsageError
from lfd_render.renderer import camera_for
from lfd_render.scene import Scene
from lfd_render.techniques.mvr import VARIANTS

SETTINGS = {
    "machine": {
        "renderer": "llvmpipe", "driver": "4.5", "processor": "some", "cores": 2, "python": "3.11",
        "version": "0.1", "commit": "abc", "date": "2026-01-01",
    },
    "effort": {"rounds": 15, "least": 3},
}  # fmt: skip


def row(technique: str, ms: float, **changes: object) -> Row:
    made = Row(
        group="builtin:car 48 1x1 default", suites=("aa",), scene="builtin:car", triangles=300_000,
        views=48, supersample=(1, 1), contender=technique, technique=technique, aa="none",
        frames_ms=[ms, 1.1 * ms, 0.9 * ms], view_rmse=5.0, view_ssim=0.9, view_size=(480, 360),
        stages_ms={"transform": 1.0, "sample": 2.0, "splat": 3.0, "weave": 4.0}, device_bytes=10**8,
    )  # fmt: skip
    return dataclasses.replace(made, **changes)


def test_names_of_techniques() -> None:
    assert techniques(["mvr", "lfdpr:default", "lfdpr"]) == ("mvr:multipass", "lfdpr")
    assert techniques(["mvr:all"]) == tuple(f"mvr:{name}" for name in VARIANTS)
    assert techniques(USUAL) == USUAL
    for wrong in ("mvr:no", "epr", "lfdpr:gold", ""):
        with pytest.raises(UsageError, match=f"technique '{wrong}': unknown; use lfdpr"):
            techniques([wrong])


def test_a_filter_is_the_points_alone_in_the_papers_tables() -> None:
    axes = Axes(techniques=("lfdpr", "mvr:multipass"), scenes=("builtin:car",))
    (table_1,) = groups_of(["aa"], axes)
    assert [c.name for c in table_1.contenders] == [
        "lfdpr", "lfdpr, spatial AA", "lfdpr, angular AA", "lfdpr, both AA", "mvr:multipass",
    ]  # fmt: skip
    space, angle = groups_of(["supersample"], axes)
    assert [c.aa for c in space.contenders] == ["spatial", "none"]
    assert [c.aa for c in angle.contenders] == ["angular", "none"]
    assert all(c.rasterises for g in groups_of(["mvr"], axes) for c in g.contenders)
    with pytest.raises(UsageError, match="suite 'speed': unknown; use mvr, aa, supersample"):
        groups_of(["speed"], axes)


def test_work_that_suites_share_is_done_once_after_its_scenes_ranking() -> None:
    axes = Axes(techniques=techniques(USUAL), scenes=("builtin:car", "builtin:gallery"))
    groups = groups_of(["mvr", "aa", "supersample", "views", "error", "triangles"], axes)
    assert len({group.key for group in groups}) == len(groups)
    assert [g.scene.partition("?")[0] for g in groups] == sorted(
        g.scene.partition("?")[0] for g in groups
    )
    ranking, main, *_ = groups
    assert ranking.ranks
    assert [c.technique for c in ranking.contenders] == sorted(
        (f"mvr:{name}" for name in VARIANTS), key=lambda name: not name.endswith("-deferred")
    )
    shown = {c.name: set(suites) for c, suites in main.contenders.items()}
    assert shown["lfdpr"] == {"aa", "error", "triangles"}
    assert shown["lfdpr, both AA"] == shown["lfdpr:paper"] == {"aa"}
    assert shown["mvr:multipass"] == {"aa", "triangles"}
    chosen = main.with_best(["mvr:loop-4-deferred", "mvr:multipass"]).contenders
    for best in ("mvr:loop-4-deferred", "mvr:multipass"):
        assert set(chosen[Contender(best)]) == shown["lfdpr"]
    assert Contender("mvr:best") not in chosen
    swept = [(g.views, g.view_size) for g in groups if "views" in g.suites and "car" in g.scene]
    assert swept == [(48, (480, 360)), (24, (480, 360)), (96, (480, 360))]
    own = [g.scene for g in groups if "triangles" in g.suites and "car" in g.scene]
    assert own == ["builtin:car", "builtin:car?triangles=100000", "builtin:car?triangles=1000000"]


def test_slow_contenders_get_fewer_frames_and_fast_ones_no_more_than_asked() -> None:
    effort = Effort(rounds=15, least=3, row_s=6.0)
    assert [effort.frames(ms) for ms in (14_500, 1_000, 0.5)] == [3, 6, 15]
    assert Effort(rounds=2).frames(14_500) == 2
    assert effort.frames(0.5, ranks=True) == 1


def test_the_ranking_keeps_what_may_be_the_best(monkeypatch: pytest.MonkeyPatch) -> None:
    unable = {"mvr:loop-deferred"}
    monkeypatch.setattr(Contender, "problem", lambda c, *_: "no" if c.technique in unable else None)
    ms = {"mvr:multipass": 20, "mvr:loop-deferred": 5, "mvr:loop-4-deferred": 8,
          "mvr:multipass-deferred": 9, "mvr:instanced-4-deferred": 9.5}  # fmt: skip
    device: Any = None
    assert fastest(device, ms, 48) == ("mvr:loop-4-deferred", "mvr:multipass-deferred")
    assert fastest(device, {**ms, "mvr:multipass-deferred": 11.0}, 48)[1:] == (
        "mvr:instanced-4-deferred",
    )
    assert fastest(device, {"mvr:multipass": 20, "mvr:loop-4": 30}, 48) == ("mvr:multipass",)
    assert fastest(device, ms, 48, close=1.05) == ("mvr:loop-4-deferred",)
    assert fastest(device, {}, 48) == ("mvr:multipass-deferred",)


def test_time_left_follows_what_was_spent() -> None:
    left = Progress([10.0, 30.0, 60.0])
    assert (left.part, span(left.left_s)) == (0.0, "2 min")
    left.add(10.0, 50.0)
    assert left.part == 0.1
    assert span(left.left_s) == "8 min"
    assert (span(40), span(3900)) == ("40 s", "1 h 05 min")


def test_ratios_are_of_the_least_disturbed_frames() -> None:
    slow, fast = row("mvr:loop-4", 0.0), row("lfdpr", 0.0)
    # A neighbour slows most frames of one: medians, 120 and 30, would say 4.
    slow.frames_ms, fast.frames_ms = [100.0, 120.0, 130.0], [30.0, 10.0, 31.0]
    assert fast.times_faster(slow) == 10.0
    assert slow.times_faster(fast) == 0.1
    assert fast.times_faster_by_cpu(slow) is None
    slow.cpu_ms, fast.cpu_ms = [45.0, 30.0], [10.0, 12.0]
    assert fast.times_faster_by_cpu(slow) == 3.0


def test_the_best_rasteriser_has_the_least_frame() -> None:
    steady, disturbed = row("mvr:loop-4", 100.0), row("mvr:multipass", 0.0)
    disturbed.frames_ms = [80.0, 150.0, 150.0]
    assert best_mvr([row("lfdpr", 10.0), steady, disturbed]) is disturbed


def test_two_runs_ratios_are_compared_by_the_same_rasteriser(tmp_path: Path) -> None:
    here = [row("lfdpr", 10.0), row("mvr:loop-4", 40.0), row("mvr:multipass", 44.0)]
    there = [row("lfdpr", 10.0), row("mvr:loop-4", 46.0), row("mvr:multipass", 45.0)]
    (first, second) = compare({"g": here}, {"g": there})
    assert (first["ratio"], first["other_ratio"], first["differ"]) == (4.0, 4.6, 0.15)
    assert not first["same_best"]
    assert second["differ"] == pytest.approx(1.1 / (45 / 46) - 1, abs=1e-4)
    text = table([first, second])
    assert "| g | lfdpr | 4.00 | 4.60 | 15.0 % |  | **over 10 %**" in text
    assert "2 ratios in both runs; the greatest difference is 15.0 %, 2 exceed 10 %." in text
    assert compare({"g": here}, {"other": there}) == []
    for rows in (here, there):
        for found in rows:
            found.cpu_ms = [1.5 * ms for ms in found.frames_ms]
    assert compare({"g": here}, {"g": there})[0]["cpu_differ"] == 0.15
    with pytest.raises(OutputError, match="cannot be read"):
        read_groups(tmp_path)
    Results(tmp_path, SETTINGS).add(here)
    assert list(read_groups(tmp_path)) == [here[0].group]


def test_scenes_take_what_they_are_not_given() -> None:
    assert scene_source("builtin:car", 0, "textures=64") == "builtin:car"
    assert scene_source("builtin:car", 5000) == "builtin:car?triangles=5000"
    given = "builtin:gallery?triangles=9&textures=16"
    assert scene_source(given, 5000, "textures=64") == given
    assert scene_source("a.gltf", 5000, "textures=64") == "a.gltf"


# ---- checks of pictures -----------------------------------------------------------------------


@pytest.fixture(scope="module")
def view_map() -> np.ndarray:
    return (
        DisplayProfile.load("gavane-2024-tilted-4k").phase_tables().view_index_map(48)[:640, :960]
    )


def panel(view_map: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A fine pattern in which depth shifts things by a pixel a view."""
    y, x = np.indices(view_map.shape[:2])[..., None]
    wave = np.sin((x + view_map) / 7.0) + np.cos(y / 11.0) + (x // 320)
    return (110 + 30 * wave + rng.normal(0, 8, view_map.shape)).clip(0, 255).astype(np.uint8)


def test_a_missing_and_a_stale_view_are_told_from_whole_frames(
    view_map: np.ndarray, rng: np.random.Generator
) -> None:
    eia = panel(view_map, rng)
    assert stray_view(eia, view_map) is None
    for view in (0, 17, 47):
        black = eia.copy()
        black[view_map == view] = 0
        assert stray_view(black, view_map) == view
        stale = np.where(view_map == view, eia[:, ::-1], eia)
        assert stray_view(stale, view_map) == view


def test_half_as_many_rows_have_none_of_the_detail_and_noise_does_not_help(
    rng: np.random.Generator,
) -> None:
    standard = rng.integers(0, 256, (40, 30, 3), dtype=np.uint8)
    half = standard[::2].repeat(2, axis=0)
    noisy = (standard + rng.normal(0, 20, standard.shape)).clip(0, 255).astype(np.uint8)
    assert detail_share([standard], (standard,)) == 1.0
    assert detail_share([half], (standard,)) == 0.0
    assert detail_share([noisy], (standard,)) == pytest.approx(1.0, abs=0.1)
    grey = np.full_like(standard, 90)
    assert detail_share([standard], (grey,)) == 1.0  # a standard without detail asks for none


def test_filtered_pictures_are_held_against_others() -> None:
    whole, half = Verdict(None, 8.0, 0.9, 0.56), Verdict(None, 14.0, 0.8, 0.31)
    assert against_peers(whole, [whole, half]).fault is None
    assert "31 % of the detail" in (against_peers(half, [whole, half]).fault or "")


def test_the_best_rasteriser_is_the_fastest_whose_picture_is_right() -> None:
    rows = [row("lfdpr", 10), row("mvr:multipass", 100), row("mvr:loop-4", 40, fault="wrong"),
            row("mvr:instanced", 60)]  # fmt: skip
    best = best_mvr(rows)
    assert best is not None
    assert best.technique == "mvr:instanced"
    assert best_mvr(rows[:1]) is None


# ---- files ------------------------------------------------------------------------------------


def test_results_go_on_where_they_stopped(tmp_path: Path) -> None:
    results = Results(tmp_path, SETTINGS)
    results.add([row("lfdpr", 10), row("mvr:multipass", 100, gap="why")])
    other = [row("lfdpr", 20, group="another")]
    results.add(other)
    path = tmp_path / LINES
    whole = path.read_text()
    path.write_text(whole[:-25])  # cut off while the second group was written
    later = json.loads(json.dumps(SETTINGS))
    later["machine"] |= {"date": "2026-01-02", "commit": "def"}
    again = Results(tmp_path, later)
    assert list(again.groups) == ["builtin:car 48 1x1 default"]
    assert again.rows == results.rows[:2]
    assert again.settings["machine"]["commit"] == "abc"
    again.add(other)
    assert path.read_text() == whole


def test_other_settings_are_refused_by_name(tmp_path: Path) -> None:
    Results(tmp_path, SETTINGS)
    changed = json.loads(json.dumps(SETTINGS))
    changed["effort"]["rounds"] = 5
    with pytest.raises(UsageError, match=r"measured with effort\.rounds 15, not 5; go on with the"):
        Results(tmp_path, changed)
    changed = json.loads(json.dumps(SETTINGS))
    changed["machine"]["renderer"] = "H100"
    with pytest.raises(UsageError, match=r"with machine\.renderer llvmpipe, not H100"):
        Results(tmp_path, changed)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("no JSON\n", "line 1 has no settings"),
        ('{"schema": "lfd-bench/1", "settings": {}}\n', "schema 'lfd-bench/1'"),
        ("{head}\n[]\n", "line 2 is no group of rows"),
        ('{head}\n{"rows": [{"group": "a"}]}\n', "line 2 is no group of rows"),
    ],
)
def test_files_that_are_none_of_ours_are_refused(tmp_path: Path, text: str, said: str) -> None:
    Results(tmp_path, SETTINGS)
    path = tmp_path / LINES
    made = text.replace("{head}", path.read_text().strip())
    path.write_text(made)
    with pytest.raises(OutputError, match=said):
        Results(tmp_path, SETTINGS)
    assert path.read_text() == made


def test_one_view_that_is_missing_of_many_shows() -> None:
    ids = np.full((32, 40, 40, 1), 4e9)
    ids[:, 10:26, 10:26] = 7.0  # a sixth of each view
    less = ids.copy()
    less[3] = 4e9
    assert differ(ids, less, "ids") == pytest.approx(0.16)


# ---- tables and plots -------------------------------------------------------------------------


def test_tables_say_ratios_gaps_faults_and_the_papers_numbers() -> None:
    rows = [
        row("lfdpr:paper", 20.0, points=1_234_567, eia_rmse=7.0, eia_ssim=0.8),
        row("mvr:multipass", 100.0, notation="P(N, →, □-□)"),
        row("mvr:instanced-deferred", 50.0, notation="P(1, ⋈, VFC|BFC)"),
        row("mvr:multiview-4", 1.0, gap="lacks GL_OVR_multiview2", frames_ms=[]),
        row("lfdpr", 1.0, fault="shows nothing in view 3", frames_ms=[]),
    ]
    text = report(rows, SETTINGS)
    line = next(line for line in text.splitlines() if "lfdpr:paper" in line)
    assert "3.00 (1.23M)" in line
    assert "| 3 | 2.50 × | 100 | 7.00 (5.00) | 0.800 (0.900) |" in line
    assert "5.82 (8.07 ×; 6.72 ×)" in line  # the paper's ratio, and with one panel pass for both
    assert r"**mvr:instanced-deferred** P(1, ⋈, VFC\|BFC) |" in text
    assert "0.50 ×" in next(line for line in text.splitlines() if "P(N, →, □-□)" in line)
    assert "- Missing: mvr:multiview-4: lacks GL_OVR_multiview2" in text
    assert "- Missing: lfdpr: wrong picture, its time left out: shows nothing in view 3" in text
    assert "2026-01-01, commit abc: llvmpipe" in text


def test_the_papers_own_speed_ups_follow_from_their_numbers() -> None:
    for printed in (*TABLE_1.values(), *TABLE_2.values()):
        parts = (printed.points_ms or 0.0) + printed.views_ms + printed.eia_ms
        assert printed.total_ms == pytest.approx(parts, abs=0.03)


def test_every_suite_has_a_table_and_sweeps_a_plot(tmp_path: Path) -> None:
    rows = []
    for suite in SUITES:
        for size in (100_000, 1_000_000):
            change: dict[str, Any] = {
                "suites": (suite,),
                "group": f"{suite} {size}",
                "triangles": size,
                "application": "ids" if suite == "applications" else "",
            }
            rows += [row(Contender(n).technique, size / 1e3, **change) for n in USUAL[:4]]
    text = report(rows, SETTINGS)
    assert text.count("### ") == len(SUITES)
    assert {p.name for p in write_plots(tmp_path, rows)} == {
        "triangles.svg", "views.svg", "error.svg",
    }  # fmt: skip
    assert "multipass" in (tmp_path / "triangles.svg").read_text()


# ---- programs from outside --------------------------------------------------------------------


class Box:
    """A rival that shows the bounds of what it is given, in every view alike."""

    leaves_out = "all but a box"

    def __init__(self, rig: Rig, size: tuple[int, int]) -> None:
        self._views, self._size, self._panel_mm = rig.views, size, rig.panel_mm

    def render(self, p_display: np.ndarray) -> np.ndarray:
        width, height = self._size
        low, high = p_display.min(axis=(0, 1))[:2], p_display.max(axis=(0, 1))[:2]
        x = (np.arange(width) + 0.5) / width * self._panel_mm[0] - self._panel_mm[0] / 2
        y = self._panel_mm[1] / 2 - (np.arange(height) + 0.5) / height * self._panel_mm[1]
        shown = ((x > low[0]) & (x < high[0]))[None, :] & ((y > low[1]) & (y < high[1]))[:, None]
        return np.repeat(shown[None], self._views, axis=0)


def test_a_rival_gets_the_scene_in_front_of_the_display(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(rivals.RIVALS, "box", Box)
    # In this process, for a new one would not know of the box.
    monkeypatch.setattr(rivals, "ProcessPoolExecutor", lambda *_: ThreadPoolExecutor(1))
    display = DisplayProfile.load("gavane-2024-tilted-4k")
    scene = Scene.load("builtin:car?triangles=20000")
    outside = rivals.Outside("box", scene, display, 3, (64, 48))
    camera = camera_for(scene, display)
    assert outside.leaves_out == "all but a box"
    assert outside.frame(camera) > 0
    assert outside.shown is not None
    assert outside.shown.shape == (3, 48, 64)
    assert 0.3 < outside.shown.mean() < 0.9
    before = outside.shown.any(axis=(0, 1)).sum()
    outside.frame(camera.turned(0.6))
    assert outside.shown.any(axis=(0, 1)).sum() != before
    outside.close()


def test_a_missing_rival_and_one_that_fails_say_so(monkeypatch: pytest.MonkeyPatch) -> None:
    display = DisplayProfile.load("gavane-2024-tilted-4k")
    scene = Scene.load("builtin:car?triangles=20000")
    monkeypatch.setattr(rivals, "ProcessPoolExecutor", lambda *_: ThreadPoolExecutor(1))
    monkeypatch.setitem(sys.modules, "embreex.rtcore_scene", None)
    with pytest.raises(UsageError, match="needs embreex: pip install embreex"):
        rivals.Outside("embree", scene, display, 3, (64, 48))
    monkeypatch.setitem(rivals.RIVALS, "box", Box)
    monkeypatch.setattr(Box, "render", lambda self, p_display: 1 / 0)
    outside = rivals.Outside("box", scene, display, 3, (64, 48))
    with pytest.raises(GpuError, match="fails: ZeroDivisionError"):
        outside.frame(camera_for(scene, display))
    outside.close()
    with pytest.raises(UsageError, match="rival 'blender': unknown; use embree, mitsuba, vtk"):
        rivals.check_names(["blender"])

"""The bench on a small display: right pictures are timed, wrong ones caught, gaps named."""

import dataclasses
from collections.abc import Callable

import pytest

from lfd_render.bench import measure
from lfd_render.bench.applications import APPLICATIONS
from lfd_render.bench.contenders import Contender
from lfd_render.bench.measure import Bench, Effort
from lfd_render.bench.row import Row, best_mvr
from lfd_render.bench.suites import Group
from lfd_render.display import DisplayProfile
from lfd_render.errors import ResourceError
from lfd_render.gpu.clock import StageClock
from lfd_render.gpu.device import Device
from lfd_render.passes.raster import Raster
from lfd_render.passes.view_target import Band
from lfd_render.renderer import Renderer, renderer
from lfd_render.renderer.options import RenderOptions
from lfd_render.techniques.lfdpr import Lfdpr
from lfd_render.techniques.mvr import ForwardMvr

from .helpers import PAPER, few_lenses

pytestmark = pytest.mark.needs("gl")

SCENE = "builtin:gallery?triangles=2000&textures=64"
EFFORT = Effort(rounds=3, compared=1, samples=2, gold_size=None)
SIZE = (60, 46)


@pytest.fixture(scope="module")
def display() -> DisplayProfile:
    lens = few_lenses(PAPER, 60.1, (480, 270))
    return lens.model_copy(update={"viewing": lens.viewing.model_copy(update={"views": 12})})


def rows_of(
    device: Device,
    display: DisplayProfile,
    *names: str,
    effort: Effort = EFFORT,
    suite: str = "aa",
    views: int = 12,
) -> dict[str, Row]:
    contenders = tuple(Contender(*name.split(",")) for name in names)
    group = Group(SCENE, views, (1, 1), dict.fromkeys(contenders, (suite,)), SIZE)
    return {row.contender: row for row in Bench(device, display, effort).rows(group)}


def test_right_pictures_are_timed_frame_by_frame_in_turn(
    device: Device, display: DisplayProfile, monkeypatch: pytest.MonkeyPatch
) -> None:
    order: list[str] = []
    frame = measure.Stage.frame

    def watched(stage: measure.Stage, *arguments: object) -> float:
        order.append(stage.choice.technique)
        return frame(stage, *arguments)

    monkeypatch.setattr(measure.Stage, "frame", watched)
    effort = dataclasses.replace(EFFORT, gold_views=12, gold_size=(120, 90))
    before = device.ledger.total
    rows = rows_of(device, display, "lfdpr", "lfdpr,both", "mvr:multipass", effort=effort)
    assert device.ledger.total == before
    for row in rows.values():
        assert (row.gap, row.fault) == (None, None)
        assert len(row.frames_ms) == len(row.cpu_ms) == 3
        assert row.median_cpu_ms > 0
        assert all(row.stage_ms(kind) > 0 for kind in ("views", "eia"))
        assert row.view_size == SIZE
        assert 1 < row.view_rmse < 60
        assert 1 < row.eia_rmse < 60
        assert row.device_bytes > 12 * 4 * SIZE[0] * SIZE[1]
    assert rows["lfdpr"].points > 0
    assert rows["lfdpr"].stage_ms("points") > 0 == rows["mvr:multipass"].stage_ms("points")
    assert best_mvr(list(rows.values())) is rows["mvr:multipass"]
    # Each has a frame from elsewhere, then all in turn, the first of which are judged.
    assert order == ["lfdpr", "lfdpr", "mvr"] * 4


def test_few_views_are_judged_by_all_there_are(device: Device, display: DisplayProfile) -> None:
    effort = dataclasses.replace(EFFORT, rounds=1)
    for views in (1, 2):
        row = rows_of(device, display, "lfdpr", effort=effort, views=views)["lfdpr"]
        assert (row.gap, row.fault, len(row.frames_ms)) == (None, None, 1)


def nothing(technique: Lfdpr, band: Band, clock: StageClock) -> None:
    """Draw nothing, in no time."""


def plant(monkeypatch: pytest.MonkeyPatch, fault: str) -> None:
    """Make LFDPR, or the views of rasterisation, wrong."""
    if fault == "nothing":
        monkeypatch.setattr(Lfdpr, "render", nothing)
    elif fault == "a view less":
        whole = ForwardMvr.render

        def less(technique: ForwardMvr, band: Band, clock: StageClock) -> None:
            if band is technique.target.warm_up_band or technique.target.rig.views == 1:
                whole(technique, band, clock)
                return
            for step in list(technique._raster.steps):
                if step != list(technique._raster.steps)[5]:
                    technique._raster(step, band, technique._placement)
            technique._raster.gather(band)

        monkeypatch.setattr(ForwardMvr, "render", less)
    else:
        plan: Callable[..., object] = renderer.plan_panel

        def half(profile: DisplayProfile, choice: RenderOptions) -> object:
            if choice.technique == "lfdpr":
                choice = dataclasses.replace(choice, view_size=(SIZE[0] // 2, SIZE[1] // 2))
            return plan(profile, choice)

        monkeypatch.setattr(renderer, "plan_panel", half)


@pytest.mark.shows(
    "The bench catches a technique that writes nothing, skips a view, is half as large"
)
@pytest.mark.parametrize(
    ("fault", "guilty", "said"),
    [
        ("nothing", "lfdpr", "shows nothing"),
        ("a view less", "mvr:multipass", "view 5 is missing, or of another frame"),
        ("half", "lfdpr", "fewer rows than asked for"),
        ("half", "lfdpr,both", "fewer rows than asked for"),
    ],
)
def test_planted_faults_are_caught(
    device: Device,
    display: DisplayProfile,
    monkeypatch: pytest.MonkeyPatch,
    fault: str,
    guilty: str,
    said: str,
) -> None:
    plant(monkeypatch, fault)
    aa = guilty.partition(",")[2] or "none"
    innocent = f"mvr:instanced,{aa}" if "lfdpr" in guilty else "lfdpr"
    rows = list(rows_of(device, display, guilty, innocent).values())
    assert said in (rows[0].fault or "")
    assert not rows[0].frames_ms
    assert not rows[0].valid
    assert rows[1].valid


def applications_of(device: Device, display: DisplayProfile, application: str) -> dict[str, Row]:
    names = APPLICATIONS[application]
    contenders = [Contender(name, application=application) for name in names]
    group = Group(SCENE, 12, (1, 1), dict.fromkeys(contenders, ("applications",)), SIZE)
    rows = Bench(device, display, EFFORT).rows(group)
    return {row.technique: row for row in rows if row.gap is None}


@pytest.mark.parametrize("application", APPLICATIONS)
def test_applications_agree_and_a_planted_fault_is_named(
    device: Device,
    display: DisplayProfile,
    monkeypatch: pytest.MonkeyPatch,
    application: str,
) -> None:
    before = device.ledger.total
    rows = applications_of(device, display, application)
    assert device.ledger.total == before
    assert {"mvr:multipass", "mvr:loop-4"} & set(rows)
    assert ("lfdpr" in rows) == (application == "ids")
    for row in rows.values():
        assert row.fault is None
        assert row.differs < 0.01
        assert len(row.frames_ms) == 3
    draw = Raster.draw

    def less(self: Raster, step: int, *arguments: object, **options: object) -> None:
        if self.pipeline.name != "multipass" or step != 5:
            draw(self, step, *arguments, **options)

    monkeypatch.setattr(Raster, "draw", less)
    rows = applications_of(device, display, application)
    assert "differs from all others" in (rows["mvr:multipass"].fault or "")
    assert not rows["mvr:multipass"].valid
    assert all(row.valid for name, row in rows.items() if name != "mvr:multipass")


def test_ideas_that_change_no_pixel_change_none(device: Device, display: DisplayProfile) -> None:
    tried = ("", "density isotropic", "shade by rays", "lattice paper", "lod none")
    contenders = [Contender("lfdpr", idea=idea) for idea in tried]
    group = Group(SCENE, 12, (1, 1), dict.fromkeys(contenders, ("ideas",)), SIZE)
    rows = Bench(device, display, dataclasses.replace(EFFORT, rounds=1)).rows(group)
    base, isotropic, rays, paper, _ = (row.view_rmse for row in rows)
    assert isotropic == base
    assert paper == rays != base
    assert rows[1].points > rows[0].points
    assert rows[4].view_rmse > rows[0].view_rmse


@pytest.mark.parametrize("error", [ResourceError("too many texels"), MemoryError("no room")])
def test_what_one_cannot_do_is_its_gap_alone(
    device: Device, display: DisplayProfile, monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    stage = Renderer.stage

    def failing(self: Renderer, *arguments: object, **options: object) -> object:
        if options["technique"] == "lfdpr":
            raise error
        return stage(self, *arguments, **options)

    monkeypatch.setattr(Renderer, "stage", failing)
    monkeypatch.setattr(
        Contender, "problem",
        lambda self, device, eyes: "no such hardware" if "multiview" in self.technique else None,
    )  # fmt: skip
    rows = rows_of(device, display, "lfdpr", "mvr:multiview-4", "mvr:multipass")
    assert str(error) in (rows["lfdpr"].gap or "")
    assert rows["mvr:multiview-4"].gap == "no such hardware"
    assert rows["mvr:multipass"].valid

"""Times contenders in turn on the same moving scene, each with its own stage on one device.

What else a machine does falls on all of them alike, so ratios within a group are what counts. The
first frame that is timed is also judged (`bench.check`), after a frame from elsewhere, so that
nothing left from before can pass; the times of a wrong picture are thrown away.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from lfd_render.bench import applications
from lfd_render.bench.check import Standard, Verdict, against_peers, verdict
from lfd_render.bench.contenders import Contender
from lfd_render.bench.gold import LEAST_SEEN, alone, chosen_views, gold_standard
from lfd_render.bench.rivals import RIVALS, Outside
from lfd_render.bench.row import Row
from lfd_render.bench.suites import Group
from lfd_render.bench.sweep import Sweep, make_sweep, sweep_errors
from lfd_render.display import Camera, DisplayProfile
from lfd_render.errors import GpuError, ResourceError, UsageError
from lfd_render.gpu.device import Device
from lfd_render.panel.eia import Eia
from lfd_render.panel.picture import read_picture, write_png
from lfd_render.quality import rmse, ssim_luma
from lfd_render.renderer import Renderer, Stage, camera_for, upright_size
from lfd_render.renderer.stage import REPEAT_TURN_RAD
from lfd_render.scene import Scene

Pixels = NDArray[np.uint8]
Told = Callable[[str], None]
_ELSEWHERE_RAD = 0.35  # how far the frame before the one that is judged is turned away
_HOPELESS = 2.0  # times as slow as the fastest of a ranking so far
_MOST_DIFFERENT = 0.02  # of buffers' pixels; on edges points and rasterisation may differ
_MOST_MISSED = 0.1  # of what a standard shows; its edges are finer than a rival's, fibres most


@dataclass(frozen=True)
class Effort:
    """How much is done. A contender gets as many counted frames as take `row_s` seconds, but from
    `least` to `rounds` of them, after a frame from elsewhere; in the ranking one. compared: views
    of the standard, with samples × samples a pixel; swept: eyes of a sweep; gold_size: pixels of
    the panel image's standard's views, None: none is made."""

    rounds: int = 15
    least: int = 3
    row_s: float = 6.0
    compared: int = 3
    samples: int = 8
    swept: int = 9
    gold_views: int = 96
    gold_size: tuple[int, int] | None = (960, 540)

    def frames(self, ms: float, ranks: bool = False) -> int:
        """Counted frames of a contender whose frame takes so long."""
        least = min(self.least, self.rounds)
        wanted = int(1000.0 * self.row_s / max(ms, 1e-3))
        return 1 if ranks else max(least, min(wanted, self.rounds))


@contextmanager
def _naming_gaps(row: Row) -> Iterator[None]:
    """What keeps one contender from its work is its gap, and no one else's."""
    try:
        yield
    except (ResourceError, GpuError, UsageError) as error:
        row.gap = str(error)
    except MemoryError as error:
        row.gap = f"out of memory: {error}"


class Frames(Protocol):
    """What is timed: a frame by a camera, its milliseconds."""

    def frame(self, camera: Camera) -> float:
        """Render it."""
        ...

    def close(self) -> None:
        """Free what frames need."""


@dataclass
class _Running:
    """A contender at work, for so many counted frames; without verdict where it is a rival from
    outside."""

    row: Row
    renderer: Renderer | None
    stage: Frames
    warm_ms: float  # of the frame before those that count
    rounds: int = 1
    verdict: Verdict | None = None


class Bench:
    """Measures group by group, keeping the scene and its standard between groups that share them.

    device: stays the caller's.
    """

    def __init__(
        self,
        device: Device,
        display: DisplayProfile,
        effort: Effort,
        told: Told = lambda _: None,
        keep: Path | None = None,
    ) -> None:
        """told: what is being done now, in a few words; keep: a folder for panel images that
        others are judged by, which take long to make."""
        self._keep = keep
        self._device, self._display, self._effort, self._told = device, display, effort, told
        self._scene: tuple[str, Scene] | None = None
        self._standards: dict[tuple[str, int, tuple[int, int]], Standard] = {}
        self._gold: dict[str, Pixels] = {}
        self._sweep: tuple[str, Sweep] | None = None

    def rows(self, group: Group) -> list[Row]:
        """Measure one group. What a contender cannot do is said in its row. Raises LfdError where
        nobody can do anything: no such scene, no room for the standard."""
        self._told(f"{group.scene}: loading")
        scene = self._load(group.scene)
        camera = camera_for(scene, self._display)
        if group.application:
            return self._application(group, scene, camera)
        standard = self._standard(group, scene, camera)
        gold = self._gold_eia(group, scene, camera)
        rows: list[Row] = []
        running: list[_Running] = []
        try:
            for contender, suites in group.contenders.items():
                row = Row.of(group, contender, suites, triangles=scene.triangle_count)
                rows.append(row)
                self._told(f"{group.scene}: preparing {row.contender}")
                start = self._start_outside if contender.technique in RIVALS else self._start
                found = start(group, row, contender, scene=scene, camera=camera, standard=standard)
                if found is None:
                    continue
                running.append(found)
                if group.ranks:  # one at a time: the whole catalogue at once takes much memory
                    least = min((r.median_ms for r in rows if r.frames_ms), default=math.inf)
                    if found.warm_ms > _HOPELESS * least:
                        row.gap = "more than twice as slow as the fastest, so not timed further"
                    else:
                        self._first(group, found, camera, standard, None)
                    _close(found)
            if group.ranks:
                _judge_together(running)
                return rows
            for found in running:
                self._told(f"{group.scene}: judging {found.row.contender}")
                self._first(group, found, camera, standard, gold)
            _judge_together(running)
            self._run(group, [found for found in running if not found.row.fault], camera)
        finally:
            for found in running:
                _close(found)
        return rows

    def _application(self, group: Group, scene: Scene, camera: Camera) -> list[Row]:
        """Buffers instead of panel images, judged by whether contenders agree."""
        rows: list[Row] = []
        running: list[_Running] = []
        buffers: list[NDArray[np.float64]] = []
        assert group.view_size is not None
        try:
            for contender, suites in group.contenders.items():
                row = Row.of(group, contender, suites, triangles=scene.triangle_count)
                rows.append(row)
                row.gap = contender.problem(self._device, group.views)
                if row.gap:
                    continue
                self._told(f"{group.scene}: preparing {row.contender}, {row.application}")
                with _naming_gaps(row):
                    before = self._device.ledger.total
                    frames = applications.start(
                        self._device, scene, self._display, contender, views=group.views,
                        size=group.view_size,
                    )  # fmt: skip
                    found = _Running(row, None, frames, frames.frame(camera.turned(_ELSEWHERE_RAD)))
                    running.append(found)
                    row.device_bytes = self._device.ledger.total - before
                    row.view_size = group.view_size
                    _count(found, camera)
                    found.rounds = self._effort.frames(row.frames_ms[0])
                    buffers.append(frames.read())
            able = [found for found in running if found.row.gap is None]
            _judge_buffers(able, buffers, group.application)
            self._run(group, [found for found in able if not found.row.fault], camera)
        finally:
            for found in running:
                _close(found)
        return rows

    def _load(self, source: str) -> Scene:
        if self._scene is None or self._scene[0] != source:
            self._scene = (source, Scene.load(source))
            self._standards.clear()
            self._gold.clear()
        return self._scene[1]

    def _standard(self, group: Group, scene: Scene, camera: Camera) -> Standard:
        size = group.view_size or upright_size(self._display, group.views)
        key = (group.scene, group.views, size)
        if key not in self._standards:
            self._told(f"{group.scene}: standard of single views")
            rig = self._display.rig(group.views)
            # The extreme views are seen from the edge of the cone, where an eye is between two.
            chosen = chosen_views(group.views, self._effort.compared + 2)
            views = tuple(chosen[1:-1] or chosen)
            with Renderer(self._device) as judge:
                pictures = tuple(
                    gold_standard(
                        judge, scene, self._display, camera, eye=alone(rig, view),
                        view_size=size,
                        samples=self._effort.samples,
                    )
                    for view in views
                )  # fmt: skip
            self._standards[key] = Standard(views, pictures)
        return self._standards[key]

    def _gold_eia(self, group: Group, scene: Scene, camera: Camera) -> Pixels | None:
        """The panel image's standard for the suites that tell of it."""
        size = self._effort.gold_size
        if size is None or not group.suites & {"aa", "supersample", "error", "ideas", "sweep"}:
            return None
        if group.scene not in self._gold:
            self._told(f"{group.scene}: standard of the panel image")
            self._gold[group.scene] = self._kept_gold(group.scene, scene, camera, size)
        return self._gold[group.scene]

    def _kept_gold(
        self, source: str, scene: Scene, camera: Camera, size: tuple[int, int]
    ) -> Pixels:
        """GStd by rasterisation, as the paper has it, written so that it is made once."""
        views = self._effort.gold_views
        made_of = f"{self._display.hash} {source} {views} {size}"
        path = self._keep and self._keep / f"gold-{sha256(made_of.encode()).hexdigest()[:12]}.png"
        if path and path.exists():
            return read_picture(path)
        # Ids tell the nearest layer alone, so what is seen through another is shaded pass by pass.
        blends = any(material.alpha_mode == "blend" for material in scene.materials)
        with Renderer(self._device) as judge:
            eia = judge.render(
                scene, self._display, camera, views, view_size=size, preset="gold", linear=False,
                technique="mvr", mvr="multipass" if blends else "multipass-deferred",
            )  # fmt: skip
        if path:
            write_png(path, eia.pixels)
        return eia.pixels

    def _swept(self, group: Group, camera: Camera) -> Sweep:
        if self._sweep is None or self._sweep[0] != group.scene:
            self._told(f"{group.scene}: standard of a sweep")
            with Renderer(self._device) as judge:
                size = group.view_size or upright_size(self._display, group.views)
                sweep = make_sweep(
                    self._display, self._effort.swept,
                    lambda rig: gold_standard(
                        judge, self._load(group.scene), self._display, camera, eye=rig,
                        view_size=size, samples=self._effort.samples,
                    ),
                )  # fmt: skip
            self._sweep = group.scene, sweep
        return self._sweep[1]

    def _start(
        self,
        group: Group,
        row: Row,
        contender: Contender,
        *,
        scene: Scene,
        camera: Camera,
        standard: Standard,
    ) -> _Running | None:
        """Stage one contender and render a frame from elsewhere; None where it cannot, as its row
        then says."""
        row.gap = contender.problem(self._device, group.eyes)
        if row.gap:
            return None
        ledger = self._device.ledger
        before = ledger.total
        renderer = Renderer(self._device)
        with _naming_gaps(row):
            begun = time.perf_counter()
            stage = renderer.stage(
                scene, self._display, camera,
                **{"views": group.views, "supersample": group.supersample,
                   "view_size": group.view_size, **contender.options},
            )  # fmt: skip
            row.compile_ms = 1000 * (time.perf_counter() - begun)
            peak = ledger.peak
            ms = stage.frame(camera.turned(_ELSEWHERE_RAD))
            row.device_bytes = max(peak, ledger.peak) - before
            return _Running(row, renderer, stage, ms)
        renderer.close()
        return None

    def _start_outside(
        self,
        group: Group,
        row: Row,
        contender: Contender,
        *,
        scene: Scene,
        camera: Camera,
        standard: Standard,
    ) -> _Running | None:
        """Stage a rival from outside, and see that it shows what the standard shows."""
        size = group.view_size or upright_size(self._display, group.views)
        with _naming_gaps(row):
            begun = time.perf_counter()
            outside = Outside(contender.technique, scene, self._display, group.views, size)
            row.compile_ms = 1000 * (time.perf_counter() - begun)
            row.leaves_out, row.view_size = outside.leaves_out, size
            ms = outside.frame(camera)
            assert outside.shown is not None
            missed = [
                float(np.mean(~outside.shown[view][picture.max(axis=-1) > LEAST_SEEN]))
                for view, picture in zip(standard.views, standard.pictures, strict=True)
            ]
            if max(missed) > _MOST_MISSED:
                row.fault = f"misses {100 * max(missed):.0f} % of what the standard shows"
            return _Running(row, Renderer(self._device), outside, ms)
        return None

    def _first(
        self,
        group: Group,
        found: _Running,
        camera: Camera,
        standard: Standard,
        gold: Pixels | None,
    ) -> None:
        """The first counted frame, read and judged."""
        row = found.row
        with _naming_gaps(row):
            _count(found, camera)
            found.rounds = self._effort.frames(row.frames_ms[0], group.ranks)
            if not isinstance(found.stage, Stage):
                return
            eia: Eia = found.stage.read()
            row.points = eia.report["points"] or 0
            row.view_size = (eia.report["view_size"][0], eia.report["view_size"][1])
            found.verdict = verdict(
                eia.pixels, self._display, self._display.rig(group.views), standard
            )
            row.stages_ms = _stages(eia.report["timings_ms"])
            if gold is not None:
                row.eia_rmse, row.eia_ssim = rmse(gold, eia.pixels), ssim_luma(gold, eia.pixels)
            if "sweep" in row.suites:
                row.sweep_flip, row.sweep_change = sweep_errors(
                    eia.pixels, self._display, self._swept(group, camera)
                )

    def _run(self, group: Group, running: list[_Running], camera: Camera) -> None:
        """A B A B: as many rounds as the slowest has frames, all contenders in each, those that
        have more frames several at once. The first frame is counted already."""
        count = min((found.rounds for found in running), default=0)
        for index in range(count):
            self._told(f"{group.scene}, {group.views} views: round {index + 1} of {count}")
            for found in running:
                done, end = (found.rounds * (index + n) // count for n in (0, 1))
                for frame in range(max(done, 1), end):
                    turn = index + (frame - done) / (end - done)
                    if found.row.gap is None:
                        with _naming_gaps(found.row):
                            _count(found, camera.turned(float(REPEAT_TURN_RAD) * turn))
        for found in running:
            with _naming_gaps(found.row):
                if found.row.gap is None and found.rounds > 1 and isinstance(found.stage, Stage):
                    found.row.stages_ms = _stages(found.stage.read().report["timings_ms"])


def _count(found: _Running, camera: Camera) -> None:
    """One counted frame."""
    begun = time.process_time()
    ms = found.stage.frame(camera)
    if not isinstance(found.stage, Outside):  # which works in another process
        found.row.cpu_ms.append(round(1000 * (time.process_time() - begun), 3))
    found.row.frames_ms.append(round(ms, 3))


def _close(found: _Running) -> None:
    found.stage.close()
    if found.renderer:
        found.renderer.close()


def _stages(timings: dict[str, float]) -> dict[str, float]:
    done_once = ("frame", "read", "upload", "compile", "prefilter")
    return {name: ms for name, ms in timings.items() if name not in done_once}


def _judge_buffers(
    running: list[_Running], buffers: list[NDArray[np.float64]], application: str
) -> None:
    """Who agrees with nobody is wrong; with one alone there is no telling but of nothing at all."""
    for found, mine in zip(running, buffers, strict=True):
        shares = [applications.differ(mine, other, application)
                  for other in buffers if other is not mine]  # fmt: skip
        found.row.differs = min(shares, default=None)
        if np.ptp(mine) == 0:
            found.row.fault = "shows nothing"
        elif found.row.differs is not None and found.row.differs > _MOST_DIFFERENT:
            found.row.fault = (
                f"differs from all others in {100 * found.row.differs:.1f} % of a view"
            )
        if found.row.fault:
            _throw_away(found.row)


def _throw_away(row: Row) -> None:
    row.frames_ms, row.cpu_ms, row.stages_ms = [], [], {}


def _judge_together(running: list[_Running]) -> None:
    """Verdicts once all are known: detail is compared between pictures under the same filter."""
    for found in running:
        if found.verdict is None:
            continue
        peers = [o.verdict for o in running if o.verdict and o.row.aa == found.row.aa]
        final = against_peers(found.verdict, peers)
        row = found.row
        row.fault, row.view_rmse, row.view_ssim = final.fault, final.rmse, final.ssim
        row.detail = final.detail
        if row.fault:
            _throw_away(row)

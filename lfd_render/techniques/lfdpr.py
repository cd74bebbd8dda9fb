"""Light field display point rendering (Gavane and Watson 2024), generated in compute by default."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from lfd_render.gpu.clock import StageClock
from lfd_render.gpu.device import Device
from lfd_render.gpu.layout import CONSTANTS
from lfd_render.gpu.scene_buffers import Batch, SceneBuffers
from lfd_render.passes.cells import SampleCells
from lfd_render.passes.owned import OwnedSplat
from lfd_render.passes.pairs import CountPairs
from lfd_render.passes.placement import Placement
from lfd_render.passes.raster_cells import RasterCells
from lfd_render.passes.sample import Sample
from lfd_render.passes.sampling import DEFAULT_SAMPLING, Points, PointSource, Sampling, Splatter
from lfd_render.passes.shade import Shade
from lfd_render.passes.share import SharedShade, pays
from lfd_render.passes.splat import Splat, view_lanes
from lfd_render.passes.splat_cells import SplatCells
from lfd_render.passes.transform import Transform
from lfd_render.passes.view_buffers import choose_winners, make_view_buffers
from lfd_render.passes.view_target import Band, ViewTarget
from lfd_render.techniques.base import Effort

SOURCES = {"compute": SampleCells, "raster": RasterCells}  # of the paper's lattice
_MOST_ROUNDS = 32  # of learning; windows halve in each


class Lfdpr:
    """transform → sample → splat (depths, winners) → shade.

    Blended materials show their nearest layer, splatted and shaded over the solid ones.
    """

    def __init__(
        self,
        device: Device,
        scene: SceneBuffers,
        target: ViewTarget,
        *,
        sampling: Sampling = DEFAULT_SAMPLING,
        general: bool = False,
        winners: str = "auto",
        lod: str = "area",
    ) -> None:
        """general: splat by each view's matrix instead of the shear that parallel views share.

        winners: how they are found, of WINNERS; owned needs the shear and rows. Raises GpuError
        where the device cannot.

        lod: how textures are filtered, one of LOD_RULES.
        """
        cells = sampling.lattice == "paper"
        if sampling.shade == "auto":
            shared = not cells and pays(scene, target.rig.views)
            sampling = replace(sampling, shade="shared" if shared else "ray")
        self.sampling = sampling
        self.winners = choose_winners(device, winners, ownable=not (general or cells))
        int64 = self.winners == "int64"
        self.target = target
        self._scene = scene
        self._transform = Transform(device)
        self._source: PointSource = (
            SOURCES[sampling.source](device, scene, target, sampling)
            if cells
            else Sample(
                device,
                scene,
                view_lanes(target.rig.views),
                sampling=sampling,
                whole_rows=general,
                binned_rows=target.band_rows if self.winners == "owned" else 0,
            )
        )
        self._splat: Splatter = (
            SplatCells(device, scene, target, sampling, int64=int64, lod=lod)
            if cells
            else OwnedSplat(device, scene, target, lod=lod, sampling=sampling)
            if self.winners == "owned"
            else Splat(
                device, scene, target, general=general, int64=int64, lod=lod, sampling=sampling
            )
        )
        self._views = make_view_buffers(device, target, self.winners)
        stride = self._views.word_stride
        self._shared: SharedShade | None = None
        if sampling.shade == "shared" and target.rig.views > 1:
            self._shared = SharedShade(device, scene, target, stride, lod=lod, sampling=sampling)
        self._shade: Shade | None = None
        if not self._shared or any(batch.alpha_mode == "blend" for batch in scene.batches):
            self._shade = Shade(device, scene, target, stride, lod=lod, sampling=sampling)
        self._points: list[Points] = [self._source.allocate(batch) for batch in scene.batches]
        self._sampled: Band | None = None  # what the points are of, at the last placement
        self._make_counter = partial(
            CountPairs, device, scene, target, sampling, general=general, lod=lod
        )

    def begin(self, placement: Placement, clock: StageClock) -> None:
        """Place the scene and transform its vertices."""
        self._placement = placement
        self._sampled = None
        with clock.stage("transform"):
            self._scene.place(placement.display_from_world)
            for batch in self._scene.batches:
                self._transform(self._scene, batch)

    def warm_up(self, clock: StageClock) -> None:
        """Render one row, and sample all bands to learn how many points there are."""
        self.render(self.target.warm_up_band, clock)
        # Rows are counted in one round and bins of rows in a second; lists of cells, whose windows
        # may have to be halved, take as many as it takes.
        owned, rows = isinstance(self._splat, OwnedSplat), isinstance(self._source, Sample)
        for _ in range(1 + owned if rows else _MOST_ROUNDS):
            for band in self.target.bands:
                for batch, points in self._batches():
                    self._source(batch, points, band)
                    for window in range(points.windows if owned or not rows else 0):
                        self._source.fill(batch, points, band, window)
            if self.complete():
                break

    def render(self, band: Band, clock: StageClock) -> None:
        """Sample, splat and shade one band of rows."""
        with clock.stage("sample"):
            self._sample(band)
        solid = [pair for pair in self._batches() if pair[0].alpha_mode != "blend"]
        with clock.stage("splat"):
            self._views.clear()
            self._find_winners(solid, band)
        with clock.stage("shade"):
            shade = self._shared or self._shade
            assert shade
            shade.opaque(solid, band, self._views, self._placement)
        blended = [pair for pair in self._batches() if pair[0].alpha_mode == "blend"]
        if blended:
            assert self._shade
            with clock.stage("blend"):
                self._views.clear_words()
                self._find_winners(blended, band)
                self._shade.blend(blended, band, self._views, self._placement)

    def _sample(self, band: Band) -> None:
        for batch, points in self._batches():
            self._source(batch, points, band)
            if points.windows == 1:
                self._source.fill(batch, points, band, 0)
        self._sampled = band

    def _find_winners(self, batches: list[tuple[Batch, Points]], band: Band) -> None:
        for step in self._splat.steps:
            for batch, points in batches:
                for window in range(points.windows):
                    if points.windows > 1:
                        self._source.fill(batch, points, band, window)
                    self._splat(step, batch, points, window=window, band=band, views=self._views)

    def complete(self) -> bool:
        """Whether there was room for all points since the last call; if not, there is now."""
        enlarged = [self._source.fit(points) for points in self._points]
        if self._shared:
            enlarged.append(self._shared.fit())
        return not any(enlarged)

    def count_points(self) -> int:
        """Points of all bands at the last placement, outside any timing. Samples again where there
        are several bands."""
        total = 0
        for band in self.target.bands:
            if band is not self._sampled:
                self._sample(band)
            total += sum(self._source.count(*pair, band) for pair in self._batches())
        return total

    def effort(self) -> Effort:
        """What a frame at the last placement takes. Samples and splats again, outside any
        timing."""
        counter = self._make_counter()
        tried = kept = visible = 0
        for band in self.target.bands:
            self._sample(band)
            for batch, points in self._batches():
                for window in range(points.windows):
                    if points.windows > 1:
                        self._source.fill(batch, points, band, window)
                    pairs = counter(batch, points, band, window)
                    tried, kept = tried + pairs[0], kept + pairs[1]
            self._views.clear()
            shown = np.zeros(0, bool)
            for blended in (False, True):
                layer = [p for p in self._batches() if (p[0].alpha_mode == "blend") == blended]
                self._views.clear_words()
                self._find_winners(layer, band)
                found = self._shown(band)
                shown = shown | found if shown.size else found
            visible += int(np.count_nonzero(shown))
        counter.release()
        return Effort(self.count_points(), tried, kept, visible)

    def _shown(self, band: Band) -> NDArray[np.bool_]:
        """Which pixels the layer splatted last shows."""
        pixels = band.rows * self.target.rig.views * self.target.grid.columns
        words = self._views.words.read(np.uint32, self._views.word_stride * pixels)
        ids = words[:: self._views.word_stride]
        return np.asarray(ids != CONSTANTS["NO_TRIANGLE"])

    def _batches(self) -> list[tuple[Batch, Points]]:
        return list(zip(self._scene.batches, self._points, strict=True))

    def release(self) -> None:
        """Free passes, points and view buffers."""
        for points in self._points:
            points.release()
        self._transform.release()
        self._source.release()
        self._splat.release()
        for shade in (self._shade, self._shared):
            if shade:
                shade.release()
        self._views.release()
        self.target.release()


class PointIds(Lfdpr):
    """transform → sample → splat: the nearest triangle of each view pixel, and no more, blended
    ones as solid."""

    def render(self, band: Band, clock: StageClock) -> None:
        """Sample and splat one band of rows."""
        with clock.stage("sample"):
            self._sample(band)
        with clock.stage("splat"):
            self._views.clear()
            self._find_winners(self._batches(), band)

    def read(self, band: Band) -> NDArray[np.uint32]:
        """Global ids of the band rendered last, or NO_TRIANGLE, [view, row, column]."""
        shape = band.rows, self.target.rig.views, self.target.grid.columns
        stride = self._views.word_stride
        words = self._views.words.read(np.uint32, stride * int(np.prod(shape)))
        return np.ascontiguousarray(words[::stride].reshape(shape).transpose(1, 0, 2))

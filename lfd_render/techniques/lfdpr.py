"""Light field display point rendering (Gavane and Watson 2024), generated in compute."""

from __future__ import annotations

from lfd_render.gpu.clock import StageClock
from lfd_render.gpu.device import Device
from lfd_render.gpu.scene_buffers import Batch, SceneBuffers
from lfd_render.passes.owned import OwnedSplat
from lfd_render.passes.placement import Placement
from lfd_render.passes.sample import PointCloud, Sample
from lfd_render.passes.shade import Shade
from lfd_render.passes.splat import Splat, view_lanes
from lfd_render.passes.transform import Transform
from lfd_render.passes.view_buffers import choose_winners, make_view_buffers
from lfd_render.passes.view_target import Band, ViewTarget


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
        stochastic_culling: bool = False,
        general: bool = False,
        winners: str = "auto",
        lod: str = "area",
    ) -> None:
        """general: splat by each view's matrix instead of the shear that parallel views share.

        winners: how they are found, of WINNERS; owned needs the shear. Raises GpuError where the
        device cannot.

        lod: how textures are filtered, one of LOD_RULES.
        """
        self.winners = choose_winners(device, winners, general=general)
        int64, owned = self.winners == "int64", self.winners == "owned"
        assert not (owned and general)
        lanes = view_lanes(target.rig.views)
        self.target = target
        self._scene = scene
        self._transform = Transform(device)
        self._sample = Sample(
            device, scene, lanes, stochastic_culling=stochastic_culling, whole_rows=general
        )
        self._splat = (
            OwnedSplat(device, scene, target, lod=lod)
            if owned
            else Splat(device, scene, target, general=general, int64=int64, lod=lod)
        )
        self._views = make_view_buffers(device, target, int64=int64)
        self._shade = Shade(device, scene, target, self._views.word_stride, lod=lod)
        self._points = [self._sample.allocate(batch) for batch in scene.batches]

    def begin(self, placement: Placement, clock: StageClock) -> None:
        """Place the scene and transform its vertices."""
        self._placement = placement
        with clock.stage("transform"):
            self._scene.place(placement.display_from_world)
            for batch in self._scene.batches:
                self._transform(self._scene, batch)

    def warm_up(self, clock: StageClock) -> None:
        """Render one row, and sample all bands to learn how many points there are."""
        self.render(self.target.warm_up_band, clock)
        for band in self.target.bands:
            for batch, points in self._batches():
                self._sample(batch, points, band)
        self.complete()
        if isinstance(self._splat, OwnedSplat):  # bins are whole now that the windows are
            for band in self.target.bands:
                for batch, points in self._batches():
                    self._sample(batch, points, band)
                    for window in range(points.windows):
                        self._sample.rows(batch, points, band, window)
                        self._splat.bin(batch, points, window=window, band=band)
            self.complete()

    def render(self, band: Band, clock: StageClock) -> None:
        """Sample, splat and shade one band of rows."""
        with clock.stage("sample"):
            for batch, points in self._batches():
                self._sample(batch, points, band)
                if points.windows == 1:
                    self._sample.rows(batch, points, band, 0)
        solid = [pair for pair in self._batches() if pair[0].alpha_mode != "blend"]
        with clock.stage("splat"):
            self._views.clear()
            self._find_winners(solid, band)
        with clock.stage("shade"):
            batches = [batch for batch, _ in solid]
            self._shade.opaque(batches, band, self._views, self._placement)
        blended = [pair for pair in self._batches() if pair[0].alpha_mode == "blend"]
        if blended:
            with clock.stage("blend"):
                self._views.clear_words()
                self._find_winners(blended, band)
                batches = [batch for batch, _ in blended]
                self._shade.blend(batches, band, self._views, self._placement)

    def _find_winners(self, batches: list[tuple[Batch, PointCloud]], band: Band) -> None:
        for step in self._splat.steps:
            for batch, points in batches:
                for window in range(points.windows):
                    if points.windows > 1:
                        self._sample.rows(batch, points, band, window)
                    self._splat(step, batch, points, window=window, band=band, views=self._views)

    def complete(self) -> bool:
        """Whether there was room for all points since the last call; if not, there is now."""
        enlarged = [self._sample.fit(points) for points in self._points] + [self._splat.fit()]
        return not any(enlarged)

    def count_points(self) -> int:
        """Points of all bands at the last placement. Samples again, outside any timing."""
        return sum(
            self._sample.count(batch, points, band)
            for band in self.target.bands
            for batch, points in self._batches()
        )

    def _batches(self) -> list[tuple[Batch, PointCloud]]:
        return list(zip(self._scene.batches, self._points, strict=True))

    def release(self) -> None:
        """Free passes, points and view buffers."""
        for points in self._points:
            points.release()
        self._transform.release()
        self._sample.release()
        self._splat.release()
        self._shade.release()
        self._views.release()
        self.target.release()

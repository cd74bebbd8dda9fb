"""Multi-view rasterisation, plain: one forward pass a view (P(N, →) of the catalogue)."""

from __future__ import annotations

from lfd_render.gpu.clock import StageClock
from lfd_render.gpu.device import Device
from lfd_render.gpu.scene_buffers import SceneBuffers
from lfd_render.passes.placement import Placement
from lfd_render.passes.raster import RasterForward
from lfd_render.passes.transform import Transform
from lfd_render.passes.view_target import Band, ViewTarget
from lfd_render.techniques.base import Effort


class Mvr:
    """transform → raster, once a view."""

    winners = None

    def __init__(
        self, device: Device, scene: SceneBuffers, target: ViewTarget, *, lod: str = "area"
    ) -> None:
        """lod: one of LOD_RULES, without `multiview`."""
        self.target = target
        self._scene = scene
        self._transform = Transform(device)
        self._raster = RasterForward(device, scene, target, lod=lod)

    def begin(self, placement: Placement, clock: StageClock) -> None:
        """Place the scene and transform its vertices."""
        self._placement = placement
        with clock.stage("transform"):
            self._scene.place(placement.display_from_world)
            for batch in self._scene.batches:
                self._transform(self._scene, batch)

    def warm_up(self, clock: StageClock) -> None:
        """Rasterise one row of one view."""
        self._rasterise(0, self.target.warm_up_band)

    def render(self, band: Band, clock: StageClock) -> None:
        """Rasterise each view's rows of the band."""
        with clock.stage("raster"):
            for view in range(self.target.rig.views):
                self._rasterise(view, band)

    def _rasterise(self, view: int, band: Band) -> None:
        self._raster(view, band, self._placement)

    def complete(self) -> bool:
        """Rasterisation needs no room."""
        return True

    def count_points(self) -> int:
        """Rasterisation has no points."""
        return 0

    def effort(self) -> Effort:
        """Rasterisation has no points."""
        return Effort()

    def release(self) -> None:
        """Free passes and target."""
        for owner in (self._transform, self._raster, self.target):
            owner.release()

"""Multi-view rasterisation: the catalogue's pipelines, each forward and by ids with deferred
shading.

VARIANTS names them: a pipeline of PIPELINES shades forward; with "-deferred" it draws ids, and what
they name is shaded by the same pass as points' winners are.
"""

from __future__ import annotations

from lfd_render.errors import UsageError
from lfd_render.gpu.clock import StageClock
from lfd_render.gpu.device import Device
from lfd_render.gpu.scene_buffers import SceneBuffers
from lfd_render.passes.pipelines import BARE, PIPELINES, SHADED, Pipeline
from lfd_render.passes.placement import Placement
from lfd_render.passes.raster_forward import RasterForward
from lfd_render.passes.raster_ids import GatherIds, RasterIds
from lfd_render.passes.shade import NoPoints, Shade
from lfd_render.passes.transform import Transform
from lfd_render.passes.view_target import Band, ViewTarget
from lfd_render.techniques.base import Effort

_DEFERRED = "-deferred"
VARIANTS = (*PIPELINES, *(name + _DEFERRED for name in PIPELINES))
DEFAULT_VARIANT = "multipass"  # shares no pass with points, so tests look with it


def pipeline_of(variant: str) -> Pipeline:
    """The pipeline of a member of VARIANTS. Raises UsageError for another name."""
    if variant not in VARIANTS:
        raise UsageError(
            f"mvr {variant!r}: unknown; use {', '.join(PIPELINES)}, or one of them with {_DEFERRED}"
        )
    return PIPELINES[variant.removesuffix(_DEFERRED)]


def notation(variant: str) -> str:
    """A variant as the catalogue writes it."""
    return pipeline_of(variant).notation + (" + deferred" if is_deferred(variant) else "")


def is_deferred(variant: str) -> bool:
    """Whether a variant draws ids and shades what they name."""
    return variant.endswith(_DEFERRED)


def problem(device: Device, variant: str, views: int) -> str | None:
    """Why a device cannot render so many views by a variant, and what would do; None if it can.

    Scenes with masked or blended materials may ask more of a loop that draws ids; `make_mvr` says.
    """
    components = BARE if is_deferred(variant) else SHADED
    return pipeline_of(variant).problem(device, views, components=components)


def supported(device: Device, views: int) -> tuple[str, ...]:
    """The members of VARIANTS by which a device can render so many views."""
    return tuple(variant for variant in VARIANTS if problem(device, variant, views) is None)


class Rasterised:
    """transform, then what a subclass renders of each band."""

    winners = None
    sampling = None

    def __init__(self, device: Device, scene: SceneBuffers, target: ViewTarget) -> None:
        self.target = target
        self._scene = scene
        self._transform = Transform(device)

    def begin(self, placement: Placement, clock: StageClock) -> None:
        """Place the scene and transform its vertices."""
        self._placement = placement
        with clock.stage("transform"):
            self._scene.place(placement.display_from_world)
            for batch in self._scene.batches:
                self._transform(self._scene, batch)

    def warm_up(self, clock: StageClock) -> None:
        """Render one row."""
        self.render(self.target.warm_up_band, clock)

    def render(self, band: Band, clock: StageClock) -> None:
        """Fill target.images with one band."""
        raise NotImplementedError

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
        """Free the transform and the target."""
        self._transform.release()
        self.target.release()


class ForwardMvr(Rasterised):
    """transform → raster, pass by pass."""

    def __init__(
        self,
        device: Device,
        scene: SceneBuffers,
        target: ViewTarget,
        *,
        pipeline: Pipeline,
        lod: str = "area",
    ) -> None:
        """lod: one of LOD_RULES, without `multiview`."""
        super().__init__(device, scene, target)
        self._raster = RasterForward(device, scene, target, lod=lod, pipeline=pipeline)

    def render(self, band: Band, clock: StageClock) -> None:
        """Rasterise each pass's views of the band."""
        with clock.stage("raster"):
            for step in self._raster.steps:
                self._raster(step, band, self._placement)
            self._raster.gather(band)

    def release(self) -> None:
        """Free passes and target."""
        self._raster.release()
        super().release()


class DeferredMvr(Rasterised):
    """transform → raster (ids), pass by pass → gather → shade.

    Blended materials show their nearest layer, drawn and shaded over the solid ones.
    """

    def __init__(
        self,
        device: Device,
        scene: SceneBuffers,
        target: ViewTarget,
        *,
        pipeline: Pipeline,
        lod: str = "area",
    ) -> None:
        """lod: one of LOD_RULES, without `multiview`."""
        super().__init__(device, scene, target)
        self._raster = RasterIds(device, scene, target, lod=lod, pipeline=pipeline)
        self._gather = GatherIds(device, target)
        self._shade = Shade(device, scene, target, self._gather.word_stride, lod=lod)
        self._no_points = NoPoints(device)

    def render(self, band: Band, clock: StageClock) -> None:
        """Rasterise each pass's views of the band, then shade all that is seen."""
        batches = [(batch, self._no_points) for batch in self._scene.batches]
        solid = [pair for pair in batches if pair[0].alpha_mode != "blend"]
        blended = [pair for pair in batches if pair[0].alpha_mode == "blend"]
        with clock.stage("raster"):
            for step in self._raster.steps:
                self._raster.solid(step, band, self._placement)
        with clock.stage("gather"):
            self._gather(self._raster, band)
        with clock.stage("shade"):
            self._shade.opaque(solid, band, self._gather, self._placement)
        if blended:
            with clock.stage("blend"):
                for step in self._raster.steps:
                    self._raster.blended(step, band, self._placement)
                self._gather(self._raster, band)
                self._shade.blend(blended, band, self._gather, self._placement)

    def release(self) -> None:
        """Free passes and target."""
        for owner in (self._raster, self._gather, self._shade, self._no_points):
            owner.release()
        super().release()


def make_mvr(
    device: Device, scene: SceneBuffers, target: ViewTarget, *, variant: str, lod: str = "area"
) -> ForwardMvr | DeferredMvr:
    """The technique of a member of VARIANTS. lod: one of LOD_RULES, without `multiview`.

    Raises GpuError where the device cannot render it.
    """
    kind = DeferredMvr if is_deferred(variant) else ForwardMvr
    return kind(device, scene, target, pipeline=pipeline_of(variant), lod=lod)

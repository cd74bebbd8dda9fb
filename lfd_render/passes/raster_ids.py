"""The nearest triangle of each view pixel, by hardware rasterisation."""

from __future__ import annotations

from lfd_render.gpu import raw as gl
from lfd_render.gpu.device import Device
from lfd_render.gpu.framebuffer import over_equal_depth
from lfd_render.gpu.layout import CONSTANTS
from lfd_render.gpu.memory import Buffer
from lfd_render.gpu.programs import Kernel
from lfd_render.gpu.scene_buffers import SceneBuffers
from lfd_render.passes.pipelines import BARE, PLAIN, SHADED, Pipeline
from lfd_render.passes.placement import Placement
from lfd_render.passes.raster import BLENDED, SOLID, BandRaster
from lfd_render.passes.view_target import Band, ViewTarget

_GROUP = 64  # local_size_x of raster/gather.comp


class RasterIds(BandRaster):
    """SceneBuffers, views → the nearest triangle of each pixel: its global id, or NO_TRIANGLE."""

    def __init__(
        self,
        device: Device,
        scene: SceneBuffers,
        target: ViewTarget,
        *,
        lod: str = "area",
        pipeline: Pipeline = PLAIN,
    ) -> None:
        """lod: what alpha is tested by, as `RasterForward`."""
        modes = {batch.alpha_mode for batch in scene.batches}
        super().__init__(
            device, scene, target, lod=lod, pipeline=pipeline,
            fragment="raster/ids.frag", formats=[gl.R32UI],
            components=BARE if modes == {"opaque"} else SHADED,
            keep_depth="blend" in modes,
        )  # fmt: skip

    def __call__(self, step: int, band: Band, placement: Placement) -> None:
        """Draw all, blended triangles where their alpha shows at all."""
        self.raster.clear(step, CONSTANTS["NO_TRIANGLE"])
        with self.raster.rasterising():
            self.raster.draw(step, (*SOLID, *BLENDED), self.views[band], band.rows, placement)

    def solid(self, step: int, band: Band, placement: Placement) -> None:
        """Draw what does not blend."""
        self.raster.clear(step, CONSTANTS["NO_TRIANGLE"])
        with self.raster.rasterising():
            self.raster.draw(step, SOLID, self.views[band], band.rows, placement)

    def blended(self, step: int, band: Band, placement: Placement) -> None:
        """Draw what blends and lies no farther than the solid; of coincident ones the last stays,
        where the other techniques keep the first."""
        self.raster.clear(step, CONSTANTS["NO_TRIANGLE"], depth=False)
        with self.raster.rasterising(), over_equal_depth(self._device):
            self.raster.draw(step, BLENDED, self.views[band], band.rows, placement)


class GatherIds:
    """RasterIds → Winners, as shading reads them, [row of the band, view, column]."""

    word_stride = 1

    def __init__(self, device: Device, target: ViewTarget) -> None:
        self._kernel = Kernel(device, "raster/gather.comp")
        self.words = Buffer(device, "view buffers", 4 * target.band_pixels)

    def __call__(self, ids: RasterIds, band: Band) -> None:
        """Gather the views of a band."""
        parts = ids.parts
        self._kernel.set(
            {"Words": self.words},
            {
                "view_size": (parts.columns, band.rows, parts.views),
                "parts": (parts.across, parts.a_layer, parts.rows),
            },
            {"id_images": ids.colors[0]},
        )
        self._kernel.run((-(-parts.columns // _GROUP), band.rows, parts.views))

    def release(self) -> None:
        """Free the kernel and the words."""
        self._kernel.release()
        self.words.release()

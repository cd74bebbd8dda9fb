"""Light-field G-buffers: what deferred shading needs of the nearest surface of each view pixel."""

from __future__ import annotations

from lfd_render.gpu import raw as gl
from lfd_render.gpu.device import Device
from lfd_render.gpu.scene_buffers import SceneBuffers
from lfd_render.passes.pipelines import PLAIN, Pipeline
from lfd_render.passes.placement import Placement
from lfd_render.passes.raster import BLENDED, SOLID, BandRaster
from lfd_render.passes.view_target import Band, ViewTarget


class RasterGbuffer(BandRaster):
    """SceneBuffers, views → three colours: base colour and metallic; shading normal in the world
    and roughness; p_display in mm and 1, or 0 where nothing is."""

    def __init__(
        self,
        device: Device,
        scene: SceneBuffers,
        target: ViewTarget,
        *,
        lod: str = "area",
        pipeline: Pipeline = PLAIN,
    ) -> None:
        """lod: one of LOD_RULES, without the one that needs points."""
        super().__init__(
            device, scene, target, lod=lod, pipeline=pipeline,
            fragment="raster/gbuffer.frag", formats=[gl.RGBA16F, gl.RGBA16F, gl.RGBA32F],
        )  # fmt: skip

    def __call__(self, step: int, band: Band, placement: Placement) -> None:
        """Render one pass's views of a band, blended surfaces where their alpha shows at all."""
        self.raster.clear(step, (0.0, 0.0, 0.0, 0.0))
        with self.raster.rasterising():
            self.raster.draw(step, (*SOLID, *BLENDED), self.views[band], band.rows, placement)

"""Forward shading of the views: the baseline, and the independent eye of the tests."""

from __future__ import annotations

from lfd_render.gpu import raw as gl
from lfd_render.gpu.device import Device
from lfd_render.gpu.framebuffer import blending_at_equal_depth, depth_only
from lfd_render.gpu.scene_buffers import SceneBuffers
from lfd_render.passes.pipelines import PLAIN, Pipeline
from lfd_render.passes.placement import Placement
from lfd_render.passes.raster import BLENDED, SOLID, BandRaster
from lfd_render.passes.view_target import Band, ViewTarget


class RasterForward(BandRaster):
    """SceneBuffers, views → ViewTarget.images: every fragment shaded as it comes.

    Blended materials show their nearest layer, drawn where its depth is; coincident blended
    triangles all blend there, where the other techniques keep one.
    """

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
            fragment="raster/forward.frag", formats=[gl.RGBA16F], into_images=True,
        )  # fmt: skip
        self._blends = any(batch.alpha_mode == "blend" for batch in scene.batches)

    def __call__(self, step: int, band: Band, placement: Placement) -> None:
        """Render one pass's views of a band."""
        raster = self.raster
        where = self.views[band], band.rows, placement
        raster.clear(step, (*placement.background, 0.0))
        with raster.rasterising():
            raster.draw(step, SOLID, *where)
            if self._blends:
                with depth_only(self._device):
                    raster.draw(step, BLENDED, *where)
                with blending_at_equal_depth(self._device):
                    raster.draw(step, BLENDED, *where)

    def gather(self, band: Band) -> None:
        """Bring views that are parts of a texture into the target's images."""
        for view in range(self.target.rig.views) if self.colors else ():
            self.target.images.copy_part(
                self.colors[0], view, self.parts.corner(view), (self.parts.columns, band.rows)
            )

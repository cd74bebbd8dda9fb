"""The catalogue's applications of multi-view rasterisation (section 4), by any of its pipelines: ID
buffers, light-field G-buffers and shadow maps. Each is timed as techniques are, and read back."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lfd_render.gpu import raw as gl
from lfd_render.gpu.clock import StageClock
from lfd_render.gpu.device import Device
from lfd_render.gpu.scene_buffers import SceneBuffers
from lfd_render.passes.pipelines import Pipeline
from lfd_render.passes.raster_depth import RasterDepth, Spots
from lfd_render.passes.raster_gbuffer import RasterGbuffer
from lfd_render.passes.raster_ids import RasterIds
from lfd_render.passes.transform import Transform
from lfd_render.passes.view_target import Band, ViewTarget
from lfd_render.techniques.mvr import Rasterised


class _Buffers(Rasterised):
    """transform → raster, pass by pass."""

    def __init__(
        self, device: Device, scene: SceneBuffers, raster: RasterIds | RasterGbuffer
    ) -> None:
        super().__init__(device, scene, raster.target)
        self._raster = raster

    def render(self, band: Band, clock: StageClock) -> None:
        """Rasterise each pass's views of the band."""
        with clock.stage("raster"):
            for step in self._raster.steps:
                self._raster(step, band, self._placement)

    def release(self) -> None:
        """Free the pass and the target."""
        self._raster.release()
        super().release()


class IdBuffers(_Buffers):
    """The nearest triangle of each view pixel."""

    def __init__(
        self, device: Device, scene: SceneBuffers, target: ViewTarget, *, pipeline: Pipeline
    ) -> None:
        """The target is this object's from now on."""
        super().__init__(device, scene, RasterIds(device, scene, target, pipeline=pipeline))

    def read(self, band: Band) -> NDArray[np.uint32]:
        """Global ids of the band rendered last, or NO_TRIANGLE, [view, row, column]."""
        (ids,) = self._raster.colors
        pixels = ids.read(np.uint32, gl.UNSIGNED_INT, channels=gl.RED_INTEGER)
        return self._raster.parts.split(pixels)[:, : band.rows]


class GBuffers(_Buffers):
    """Base colour, normal and place of each view pixel's surface."""

    def __init__(
        self,
        device: Device,
        scene: SceneBuffers,
        target: ViewTarget,
        *,
        pipeline: Pipeline,
        lod: str = "area",
    ) -> None:
        """The target is this object's from now on. lod: one of LOD_RULES, without `multiview`."""
        raster = RasterGbuffer(device, scene, target, lod=lod, pipeline=pipeline)
        super().__init__(device, scene, raster)

    def read(self, band: Band) -> tuple[NDArray[np.float32], ...]:
        """Of the band rendered last, [view, row, column, 4] each: linear base colour and metallic;
        shading normal in the world and roughness; p_display in mm and 1, or 0 where nothing is."""
        return tuple(
            self._raster.parts.split(color.read(np.float32, gl.FLOAT))[:, : band.rows]
            for color in self._raster.colors
        )


class ShadowMaps:
    """transform → raster: the nearest depths before each of many spots."""

    def __init__(
        self,
        device: Device,
        scene: SceneBuffers,
        count: int,
        size: tuple[int, int],
        *,
        pipeline: Pipeline,
    ) -> None:
        """count: of spots; size: columns and rows of a map."""
        self._scene = scene
        self._transform = Transform(device)
        self._raster = RasterDepth(device, scene, count, size, pipeline=pipeline)

    def render(self, spots: Spots, clock: StageClock) -> None:
        """Draw the maps of as many spots as there are maps."""
        with clock.stage("transform"):
            self._scene.place(np.eye(4))
            for batch in self._scene.batches:
                self._transform(self._scene, batch)
        with clock.stage("raster"):
            self._raster(spots)

    def read(self) -> NDArray[np.float32]:
        """Depths along the spots' axes, [spot, y, x], in the world's unit; ∞ where nothing is."""
        return self._raster.read()

    def release(self) -> None:
        """Free the passes."""
        self._transform.release()
        self._raster.release()

"""The applications that the catalogue of multi-view rasterisation measures (its section 4), timed:
ID buffers, light-field G-buffers, shadow maps. Points give ID buffers too, by the same splats as
their pictures have; neither what a surface is made of nor eyes off the line that views lie on.
"""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from lfd_render.bench.contenders import Contender
from lfd_render.display import Camera, DisplayProfile, ViewGrid
from lfd_render.errors import GpuError
from lfd_render.gpu.clock import StageClock
from lfd_render.gpu.device import Device
from lfd_render.gpu.scene_buffers import SceneBuffers
from lfd_render.passes.pipelines import PIPELINES, Pipeline
from lfd_render.passes.placement import Placement
from lfd_render.passes.raster_depth import Spots
from lfd_render.passes.view_target import ViewTarget
from lfd_render.scene import Scene
from lfd_render.techniques.lfdpr import PointIds
from lfd_render.techniques.mvr_buffers import GBuffers, IdBuffers, ShadowMaps

# Those of the catalogue's tables, by what they show, and points where they can do the same.
APPLICATIONS: dict[str, tuple[str, ...]] = {
    "ids": ("mvr:multipass", "mvr:loop-4-frustum", "mvr:invocations-4", "mvr:multiview-4", "lfdpr"),
    "g-buffers": ("mvr:multipass", "mvr:loop-4", "mvr:invocations-4", "mvr:multiview-4"),
    "shadow maps": ("mvr:multipass", "mvr:loop-4", "mvr:invocations-4", "mvr:multiview-4"),
}
_NEAR = 0.02  # what G-buffers and depths may differ by, of their own size and at least 1


class _Views:
    """ID buffers or G-buffers of a display's views."""

    def __init__(
        self,
        device: Device,
        scene: Scene,
        display: DisplayProfile,
        contender: Contender,
        *,
        views: int,
        size: tuple[int, int],
    ) -> None:
        self._device, self._rig = device, display.rig(views)
        self._buffers = SceneBuffers(device, scene)
        self._buffers.pose(None)
        grid = ViewGrid.upright(display, *size)
        target = ViewTarget(device, self._rig, grid, self._buffers.batches)
        kind, _, variant = contender.technique.partition(":")
        self._technique: PointIds | IdBuffers | GBuffers
        if kind == "lfdpr":
            self._technique = PointIds(device, self._buffers, target)
        else:
            made = IdBuffers if contender.application == "ids" else GBuffers
            self._technique = made(device, self._buffers, target, pipeline=PIPELINES[variant])

    def frame(self, camera: Camera) -> float:
        """All views by a camera; milliseconds."""
        placement = Placement(camera.display_from_world(self._rig.panel_mm), (0.0, 0.0, 0.0))
        technique, clock = self._technique, StageClock(self._device)
        self._device.finish()
        begun = time.perf_counter()
        technique.begin(placement, clock)
        for band in technique.target.bands:
            technique.render(band, clock)
        spent = 1000 * (time.perf_counter() - begun)  # stages end on an idle device
        # A first frame may find too little room for its points.
        return spent if technique.complete() else self.frame(camera)

    def read(self) -> NDArray[np.float64]:
        """What the last band of the last frame holds, [view, row, column, value]."""
        found = self._technique.read(self._technique.target.bands[-1])
        if isinstance(found, tuple):
            return np.concatenate(found, axis=-1).astype(np.float64)
        return found[..., None].astype(np.float64)

    def close(self) -> None:
        """Free the scene and what was made of it."""
        self._technique.release()
        self._buffers.release()


class _Shadows:
    """Shadow maps of lights scattered in the scene."""

    def __init__(
        self,
        device: Device,
        scene: Scene,
        pipeline: Pipeline,
        *,
        lights: int,
        size: tuple[int, int],
    ) -> None:
        self._device, self._bounds, self._lights = device, scene.bounds(), lights
        self._buffers = SceneBuffers(device, scene)
        self._buffers.pose(None)
        self._maps = ShadowMaps(device, self._buffers, lights, size, pipeline=pipeline)

    def frame(self, camera: Camera) -> float:
        """All maps; each camera has lights of its own, the same for all contenders."""
        eye = np.ascontiguousarray(camera.display_from_world((1.0, 1.0)), np.float64)
        seed = int(np.abs(eye.view(np.uint64)).sum() % (1 << 32))
        spots = Spots.scattered(self._bounds, self._lights, seed)
        self._device.finish()
        begun = time.perf_counter()
        self._maps.render(spots, StageClock(self._device))
        return 1000 * (time.perf_counter() - begun)

    def read(self) -> NDArray[np.float64]:
        """Depths of the last frame, 0 where nothing is, [light, y, x, 1]."""
        depths = self._maps.read()[..., None].astype(np.float64)
        return np.where(np.isfinite(depths), depths, 0.0)

    def close(self) -> None:
        """Free the scene and the maps."""
        self._maps.release()
        self._buffers.release()


ApplicationFrames = _Views | _Shadows


def start(
    device: Device,
    scene: Scene,
    display: DisplayProfile,
    contender: Contender,
    *,
    views: int,
    size: tuple[int, int],
) -> ApplicationFrames:
    """A contender ready for its frames. Raises GpuError or ResourceError where it cannot."""
    variant = contender.technique.partition(":")[2]
    if contender.application != "shadow maps":
        return _Views(device, scene, display, contender, views=views, size=size)
    if not variant:
        raise GpuError("points are seen by eyes on one line, lights stand anywhere")
    return _Shadows(device, scene, PIPELINES[variant], lights=views, size=size)


def differ(one: NDArray[np.float64], other: NDArray[np.float64], application: str) -> float:
    """Share of pixels in which two do not agree, ids to the bit, else within 2 %, in the view where
    it is largest: one view that is missing is no small part of itself, however many there are."""
    apart = np.abs(one - other)
    limit = 0.0 if application == "ids" else _NEAR * np.maximum(1.0, np.abs(one))
    return float((apart > limit).any(axis=-1).mean(axis=(1, 2)).max())

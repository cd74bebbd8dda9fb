"""What splatting costs, counted: pixels that points try, and those that they keep."""

from __future__ import annotations

import numpy as np

from lfd_render.gpu.device import Device
from lfd_render.gpu.layout import dtype, lod_constants
from lfd_render.gpu.memory import Buffer
from lfd_render.gpu.programs import Kernel
from lfd_render.gpu.scene_buffers import Batch, SceneBuffers
from lfd_render.passes.cells import CellCloud, strip_rows, strips
from lfd_render.passes.items import GROUPS_ACROSS
from lfd_render.passes.sample import PointCloud
from lfd_render.passes.sampling import Points, Sampling
from lfd_render.passes.splat import projection_buffers, view_lanes
from lfd_render.passes.view_target import Band, ViewTarget


class CountPairs:
    """PointCloud or CellCloud → (tried, kept), summed over views.

    A row of points or a point tries each view it faces at least once, also where it covers no pixel
    centre.
    Kept is what lies inside the triangle and is opaque. It reads back, so it is not for frames.
    """

    def __init__(
        self,
        device: Device,
        scene: SceneBuffers,
        target: ViewTarget,
        sampling: Sampling,
        *,
        general: bool = False,
        lod: str = "area",
    ) -> None:
        self._scene = scene
        self._lanes = view_lanes(target.rig.views)
        self._strip_rows = strip_rows(scene, target)
        self._projection = projection_buffers(device, target) if general else {}
        constants = {
            "VIEW_LANES": self._lanes,
            "GROUPS_ACROSS": GROUPS_ACROSS,
            **scene.constants(),
            **lod_constants(lod),
            **sampling.constants(),
        }
        kind = "cells" if sampling.lattice == "paper" else "general" if general else "rows"
        self._kernels = {
            tested: Kernel(
                device, f"splat/count_{kind}.comp", {**constants, "ALPHA_TESTED": int(tested)}
            )
            for tested in sorted({batch.alpha_mode != "opaque" for batch in scene.batches})
        }
        self._pairs = Buffer(device, "pairs", dtype("Pairs").itemsize)

    def __call__(self, batch: Batch, points: Points, band: Band, window: int) -> tuple[int, int]:
        """Those of the window filled last."""
        assert isinstance(points, PointCloud | CellCloud)
        self._pairs.fill(0)
        kernel = self._kernels[batch.alpha_mode != "opaque"]
        buffers = {
            **batch.geometry(),
            **batch.attributes(),
            **self._scene.materials_of(),
            **self._projection,
            **points.splat_blocks(),
            "Draws": self._scene.draws,
            "FrameBlock": band.frame(batch),
            "Eyes": band.target.eyes,
            "RowOffsets": band.target.row_offsets,
            "PairsBlock": self._pairs,
        }
        if isinstance(points, CellCloud):
            count = int(points.work.read(dtype("CellWork"))["points"][0])
            runs = strips(band, points, self._strip_rows)
        else:
            count = int(points.work.read(dtype("Work"))["items"][window])
            runs = [{"window": window}]
        lines = -(-count // GROUPS_ACROSS)
        for uniforms in runs:
            kernel.set(buffers, uniforms, self._scene.samplers())
            kernel.run((min(count, GROUPS_ACROSS), lines, -(-band.target.rig.views // self._lanes)))
        words = self._pairs.read(np.uint32).astype(object)
        return words[0] + (words[1] << 32), words[2] + (words[3] << 32)

    def release(self) -> None:
        """Free the kernels and buffers."""
        for owner in (*self._kernels.values(), *self._projection.values(), self._pairs):
            owner.release()

"""Splatting points of the paper's lattice: each fills what its box holds of its triangle."""

from __future__ import annotations

from lfd_render.gpu.device import Device
from lfd_render.gpu.layout import lod_constants
from lfd_render.gpu.programs import Kernel
from lfd_render.gpu.scene_buffers import Batch, SceneBuffers
from lfd_render.passes.cells import CellCloud, strip_rows, strips
from lfd_render.passes.items import GROUPS_ACROSS
from lfd_render.passes.sampling import Sampling
from lfd_render.passes.splat import view_lanes
from lfd_render.passes.view_buffers import ViewBuffers
from lfd_render.passes.view_target import Band, ViewTarget


class SplatCells:
    """CellCloud, ViewTarget → ViewBuffers. Nearest depth wins; at equal depth the smaller id.

    The same words as from rows of points, bit for bit.
    """

    def __init__(
        self,
        device: Device,
        scene: SceneBuffers,
        target: ViewTarget,
        sampling: Sampling,
        *,
        int64: bool = False,
        lod: str = "area",
    ) -> None:
        """lod: one of LOD_RULES, for alpha."""
        self.steps = range(1 if int64 else 2)
        self._scene = scene
        self._strip_rows = strip_rows(scene, target)
        constants = {
            "VIEW_LANES": view_lanes(target.rig.views),
            "GROUPS_ACROSS": GROUPS_ACROSS,
            **scene.constants(),
            **lod_constants(lod),
            **sampling.constants(),
        }
        path = "splat/cells_int64.comp" if int64 else "splat/cells.comp"
        self._kernels = {
            (step, tested): Kernel(
                device, path, {**constants, "STEP": step, "ALPHA_TESTED": int(tested)}
            )
            for tested in sorted({batch.alpha_mode != "opaque" for batch in scene.batches})
            for step in self.steps
        }

    def __call__(
        self,
        step: int,
        batch: Batch,
        points: CellCloud,
        *,
        window: int,
        band: Band,
        views: ViewBuffers,
    ) -> None:
        """Splat the points listed last, strip by strip."""
        del window  # the list holds one at a time
        kernel = self._kernels[step, batch.alpha_mode != "opaque"]
        buffers = {
            **batch.geometry(),
            **batch.attributes(),
            **self._scene.materials_of(),
            **views.blocks(),
            **points.splat_blocks(),
            "Draws": self._scene.draws,
            "FrameBlock": band.frame(batch),
            "Eyes": band.target.eyes,
            "RowOffsets": band.target.row_offsets,
        }
        for strip in strips(band, points, self._strip_rows):
            kernel.set(buffers, strip, self._scene.samplers())
            kernel.run_indirect(points.work)

    def release(self) -> None:
        """Free the kernels."""
        for kernel in self._kernels.values():
            kernel.release()

"""The paper's front end: points of its lattice by the hardware's rasteriser."""

from __future__ import annotations

from lfd_render.errors import UnsupportedError
from lfd_render.gpu.device import Device
from lfd_render.gpu.framebuffer import EmptyTarget, IndexedDraws, conservative_raster
from lfd_render.gpu.layout import CONSTANTS
from lfd_render.gpu.memory import Buffer
from lfd_render.gpu.programs import RasterProgram
from lfd_render.gpu.scene_buffers import Batch, SceneBuffers
from lfd_render.passes.cells import CellCloud, CellSource
from lfd_render.passes.sampling import Sampling
from lfd_render.passes.view_target import Band, ViewTarget

CONSERVATIVE = "GL_NV_conservative_raster"


class RasterCells(CellSource):
    """Batch, Band → CellCloud by vertex, geometry and fragment stages (section 3, figure 4).

    The same points as `SampleCells`, in another order. Windows are ranges of triangles.
    """

    def __init__(
        self, device: Device, scene: SceneBuffers, target: ViewTarget, sampling: Sampling
    ) -> None:
        """Raises UnsupportedError where stages before the fragment's have no storage blocks."""
        super().__init__(device, scene, target, sampling)
        if not device.info.geometry_storage:
            raise UnsupportedError(
                f"point source 'raster': the geometry stage of {device.name} has too few storage "
                "blocks; use compute, which makes the same points"
            )
        self._conservative = CONSERVATIVE in device.info.extensions
        self._target_view = EmptyTarget(device, CONSTANTS["MOST_CELLS"], CONSTANTS["MOST_CELLS"])
        self._program = RasterProgram(
            device,
            "cells/align.vert",
            "cells/append.frag",
            {**self._constants, "CONSERVATIVE": int(self._conservative)},
            geometry_path="cells/align.geom",
        )
        self._indices: dict[int, Buffer] = {}
        self._draws: dict[int, IndexedDraws] = {}
        for batch in scene.batches:
            indices = Buffer.of(device, "indices", batch.corner_indices())
            self._indices[batch.triangle_base] = indices
            self._draws[batch.triangle_base] = IndexedDraws(device, self._program, indices)

    def __call__(self, batch: Batch, points: CellCloud, band: Band) -> None:
        """Nothing is known before points are appended."""

    def _append(self, batch: Batch, points: CellCloud, band: Band, window: int) -> None:
        step = -(-batch.triangles // points.windows)
        first = window * step
        count = min(step, batch.triangles - first)
        if count <= 0:
            return
        self._program.set(
            {
                **batch.geometry(),
                **batch.attributes(),
                **self._scene.materials_of(),
                "Draws": self._scene.draws,
                "FrameBlock": band.frame(batch),
                "Eyes": band.target.eyes,
                **points.splat_blocks(),
            },
            {"first_triangle": first, "room": points.room},
        )
        self._target_view.use()
        with conservative_raster(self._device, self._conservative):
            self._draws[batch.triangle_base].draw(first, count)
        self._device.barrier()

    def _divide(self, points: CellCloud) -> None:
        points.windows *= 2

    def release(self) -> None:
        """Free the program, its target and indices."""
        super().release()
        for owner in (*self._draws.values(), *self._indices.values()):
            owner.release()
        self._program.release()
        self._target_view.release()

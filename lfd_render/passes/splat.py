"""Splatting: points → the winning triangle of each view pixel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import Rig, ViewGrid
from lfd_render.gpu.device import Device
from lfd_render.gpu.layout import dtype, lod_constants
from lfd_render.gpu.memory import Buffer
from lfd_render.gpu.programs import Kernel
from lfd_render.gpu.scene_buffers import Batch, SceneBuffers
from lfd_render.passes.items import GROUP_ROWS, GROUPS_ACROSS
from lfd_render.passes.sample import PointCloud
from lfd_render.passes.sampling import DEFAULT_SAMPLING, Sampling
from lfd_render.passes.view_buffers import ViewBuffers
from lfd_render.passes.view_target import Band, ViewTarget


def view_lanes(views: int) -> int:
    """Views that a work group takes side by side: a multiple of 8, at most 64."""
    return min(64, -(-views // 8) * 8)


class Splat:
    """PointCloud, ViewTarget → ViewBuffers. Nearest depth wins; at equal depth the smaller id.

    `steps` passes over all points: one of 64-bit atomics, or two of 32-bit ones, depths first. The
    result depends neither on the order of points nor on batches, and is the same for both.
    """

    def __init__(
        self,
        device: Device,
        scene: SceneBuffers,
        target: ViewTarget,
        *,
        general: bool = False,
        int64: bool = False,
        lod: str = "area",
        sampling: Sampling = DEFAULT_SAMPLING,
    ) -> None:
        """general: by each view's matrix instead of the shear that parallel views share.

        lod: one of LOD_RULES, for alpha.
        """
        self.steps = range(1 if int64 else 2)
        path = f"splat/{'general' if general else 'shear'}{'_int64' if int64 else ''}.comp"
        constants = {
            "VIEW_LANES": view_lanes(target.rig.views),
            "GROUP_ROWS": GROUP_ROWS,
            "GROUPS_ACROSS": GROUPS_ACROSS,
            **scene.constants(),
            **lod_constants(lod),
            **sampling.constants(),
        }
        self._scene = scene
        self._projection = projection_buffers(device, target) if general else {}
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
        points: PointCloud,
        *,
        window: int,
        band: Band,
        views: ViewBuffers,
    ) -> None:
        """Splat one window of points; every window and batch has had its step before the next."""
        kernel = self._kernels[step, batch.alpha_mode != "opaque"]
        kernel.set(
            {
                **batch.geometry(),
                **batch.attributes(),
                **self._scene.materials_of(),
                **self._projection,
                **views.blocks(),
                "Draws": self._scene.draws,
                "FrameBlock": band.frame(batch),
                **points.splat_blocks(),
                "Eyes": band.target.eyes,
                "RowOffsets": band.target.row_offsets,
            },
            {"window": window},
            self._scene.samplers(),
        )
        kernel.run_indirect(points.work, window * dtype("Work").itemsize)

    def release(self) -> None:
        """Free the kernels."""
        for kernel in self._kernels.values():
            kernel.release()
        for buffer in self._projection.values():
            buffer.release()


def projection_buffers(device: Device, target: ViewTarget) -> dict[str, Buffer]:
    """What the general projection reads of a rig, by block name."""
    matrices, shifts = pixel_matrices(target.rig, target.grid)
    return {
        "PixelMatrices": Buffer.of(device, "rig", matrices),
        "RowShifts": Buffer.of(device, "rig", shifts),
    }


def pixel_matrices(rig: Rig, grid: ViewGrid) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Each view's display space → (column·w, row·w, 0, w), and how columns are shifted by row.

    Returns float32 [view, 16] as GLSL lays a mat4 out, and int32 [row]: a matrix's column less the
    stored one, which steps with the lenses where the view follows them.
    """
    shifts = (grid.row_base - grid.row_base[0]).astype(np.int32) * grid.fineness
    offsets = grid.row_offset + shifts
    slope = float(offsets[-1] - offsets[0]) / max(grid.rows - 1, 1)
    start = float(offsets[0]) - 0.5 * slope
    pixel_from_clip = np.zeros((4, 4))
    pixel_from_clip[3, 3] = 1.0
    pixel_from_clip[1, [1, 3]] = -0.5 * grid.rows, 0.5 * grid.rows  # rows run downward
    window_columns = rig.panel_mm[0] / grid.column_mm
    pixel_from_clip[0, [0, 3]] = 0.5 * window_columns, start
    pixel_from_clip[0] += slope * pixel_from_clip[1]
    matrices = pixel_from_clip @ rig.matrices()
    return matrices.transpose(0, 2, 1).reshape(-1, 16).astype(np.float32), shifts

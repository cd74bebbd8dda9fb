"""Hardware rasterisation of one view: the baseline's pass, and the independent eye of the tests."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import Rig, ViewGrid
from lfd_render.gpu.device import Device
from lfd_render.gpu.framebuffer import (
    IndexedDraws,
    LayerTarget,
    blending_at_equal_depth,
    depth_only,
    face_culling,
    rasterising,
)
from lfd_render.gpu.layout import lod_constants
from lfd_render.gpu.memory import Buffer
from lfd_render.gpu.programs import RasterProgram, Samplers, Uniform
from lfd_render.gpu.scene_buffers import Batch, SceneBuffers
from lfd_render.passes.placement import Placement, gl_matrix
from lfd_render.passes.view_target import Band, ViewTarget

_Camera = dict[str, Uniform]


class RasterForward:
    """SceneBuffers, one eye → one layer of ViewTarget.images: every fragment shaded as it comes.

    Blended materials show their nearest layer, drawn where its depth is; coincident blended
    triangles all blend there, where the other techniques keep one.
    """

    def __init__(
        self, device: Device, scene: SceneBuffers, target: ViewTarget, *, lod: str = "area"
    ) -> None:
        """lod: one of LOD_RULES, without the one that needs points."""
        assert lod != "multiview"
        self._device = device
        self._scene = scene
        self._target = target
        self._layer = LayerTarget(device, target.images, depth=True)
        self._programs = {
            alpha_mode: RasterProgram(
                device,
                "raster/forward.vert",
                "raster/forward.frag",
                {
                    "ALPHA_TESTED": int(alpha_mode != "opaque"),
                    "BLENDED": int(alpha_mode == "blend"),
                    "MARGIN_COLUMNS": max(2, target.grid.fineness),
                    **scene.constants(),
                    **scene.lighting.constants(),
                    **lod_constants(lod),
                },
            )
            for alpha_mode in sorted({batch.alpha_mode for batch in scene.batches})
        }
        self._indices: list[Buffer] = []
        self._draws: list[IndexedDraws] = []
        for batch in scene.batches:
            self._indices.append(Buffer.of(device, "indices", batch.corner_indices()))
            program = self._programs[batch.alpha_mode]
            self._draws.append(IndexedDraws(device, program, self._indices[-1]))

    def __call__(self, view: int, band: Band, placement: Placement) -> None:
        """Render one view's rows of a band, row 0 of the layer on top."""
        rig = self._target.rig
        eye_mm = float(rig.eye_x_mm[view])
        clip = band_clip_from_display(rig, self._target.grid, band, view)
        camera: _Camera = {
            "clip_from_display": gl_matrix(clip),
            "turn_from_display": gl_matrix(placement.turn_from_display),
            "eye_mm": eye_mm,
        }
        batches = list(zip(self._scene.batches, self._draws, strict=True))
        blended = [pair for pair in batches if pair[0].alpha_mode == "blend"]
        self._layer.use(view, band.rows)
        self._layer.clear((*placement.background, 0.0))
        with rasterising(self._device):
            for batch, draws in batches:
                if batch.alpha_mode != "blend":
                    self._draw_batch(batch, draws, band, camera)
            with depth_only(self._device):
                for batch, draws in blended:
                    self._draw_batch(batch, draws, band, camera)
            with blending_at_equal_depth(self._device):
                for batch, draws in blended:
                    self._draw_batch(batch, draws, band, camera)

    def _draw_batch(
        self,
        batch: Batch,
        draws: IndexedDraws,
        band: Band,
        camera: _Camera,
    ) -> None:
        """Draw a batch's runs: sides culled as each run's materials and placements ask."""
        buffers = {
            "DisplayPositions": batch.display_positions,
            "LocalPositions": batch.local_positions,
            "Draws": self._scene.draws,
            **batch.attributes(),
            "WorldNormals": batch.world_normals,
            "FrameBlock": band.frame(batch),
            **self._scene.materials_of(),
            **self._scene.lighting.buffers(),
        }
        samplers: Samplers = {**self._scene.samplers(), **self._scene.lighting.samplers()}
        self._programs[batch.alpha_mode].set(buffers, camera, samplers)
        for run in self._scene.runs(batch):
            face_culling(self._device, double_sided=run.double_sided, mirrored=run.mirrored)
            draws.draw(run.first, run.count)

    def release(self) -> None:
        """Free everything but the target."""
        for draws in self._draws:
            draws.release()
        for buffer in self._indices:
            buffer.release()
        for program in self._programs.values():
            program.release()
        self._layer.release()


def band_clip_from_display(rig: Rig, grid: ViewGrid, band: Band, view: int) -> NDArray[np.float64]:
    """clip_from_display, float64 [4, 4], of one view's band: column c of row r has its centre at
    the raster's (c + ½, r − band.first + ½), row 0 at the bottom.

    column·d = D·X/column_mm + (d − D)·eye + offset·d, with an offset linear in the row (`upright`
    or `sheared` grids), and row·d = (h/2·d − D·Y)/row_mm; d = D − Z; depth d − 2·near.
    """
    distance = rig.distance_mm
    height = rig.panel_mm[1]
    eye = rig.eye_x_mm[view] / grid.column_mm
    row_mm = height / grid.rows
    slope = float(grid.row_offset[1] - grid.row_offset[0]) if grid.rows > 1 else 0.0
    start = float(grid.row_offset[0]) - 0.5 * slope
    assert np.allclose(grid.row_offset, start + slope * (np.arange(grid.rows) + 0.5), atol=1e-6)

    depth = np.array([0.0, 0.0, -1.0, distance])
    row = 0.5 * height / row_mm * depth + np.array([0.0, -distance / row_mm, 0.0, 0.0])
    column = np.array([distance / grid.column_mm, 0.0, -eye, 0.0]) + start * depth + slope * row
    return np.stack(
        [
            2.0 / grid.columns * column - depth,
            2.0 / band.rows * (row - band.first * depth) - depth,
            depth + np.array([0.0, 0.0, 0.0, -2.0 * rig.near_mm]),
            depth,
        ]
    )

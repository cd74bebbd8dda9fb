"""Sampling: triangles → the rows of visible triangles, whose points are enumerated, not stored."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lfd_render.gpu.device import Device
from lfd_render.gpu.layout import dtype
from lfd_render.gpu.memory import Buffer
from lfd_render.gpu.programs import Kernel
from lfd_render.gpu.scene_buffers import Batch, SceneBuffers
from lfd_render.passes.view_target import Band, ViewTarget

SEGMENT = 64  # triangles a thread of the prefix sum takes
GROUP_ITEMS = 32  # rows of triangles a work group of the splatter takes
GROUPS_ACROSS = 32768  # work groups along x before y grows
_GROUP = 128  # local_size_x of sample/span.comp
_SEGMENT_GROUP = 64  # local_size_x of sample/sum.comp and sample/compact.comp


@dataclass(frozen=True)
class PointCloud:
    """Points of one batch and band, enumerated: a visible triangle's rows, and on each row the
    cells of the densest eye's columns. Bounded by the triangle count, so nothing overflows.

    spans: Span [triangle]; visible: Visible [≤ triangles], in triangle order; work: one Work.
    """

    spans: Buffer
    visible: Buffer
    work: Buffer
    segments: Buffer

    def blocks(self) -> dict[str, Buffer]:
        """What splatting reads, by block name."""
        return {"Spans": self.spans, "VisibleTriangles": self.visible, "WorkBlock": self.work}

    def release(self) -> None:
        """Free the buffers."""
        for buffer in (self.spans, self.visible, self.work, self.segments):
            buffer.release()


class Sample:
    """Batch, ViewTarget → PointCloud.

    Clips at the near plane, culls triangles that no view faces or that reach no row centre, sets
    each triangle's point length (Gavane and Watson 2024, section 3.1) and sums the rows.
    """

    def __init__(
        self,
        device: Device,
        scene: SceneBuffers,
        view_lanes: int,
        *,
        stochastic_culling: bool = False,
    ) -> None:
        self._device = device
        self._view_lanes = view_lanes
        constants = {
            "SEGMENT": SEGMENT,
            "GROUP_ITEMS": GROUP_ITEMS,
            "GROUPS_ACROSS": GROUPS_ACROSS,
        }
        self._span = Kernel(
            device,
            "sample/span.comp",
            {"STOCHASTIC_CULLING": int(stochastic_culling), **scene.constants()},
        )
        self._sum = Kernel(device, "sample/sum.comp", constants)
        self._scan = Kernel(device, "sample/scan.comp", constants)
        self._compact = Kernel(device, "sample/compact.comp", constants)
        self._count = Kernel(device, "sample/count.comp", constants)
        self._total = Buffer(device, "points", 4)

    def allocate(self, batch: Batch) -> PointCloud:
        """Buffers for a batch's points: 16 bytes a triangle."""
        segments = -(-batch.triangles // SEGMENT)
        return PointCloud(
            spans=Buffer(self._device, "points", dtype("Span").itemsize * batch.triangles),
            visible=Buffer(self._device, "points", dtype("Visible").itemsize * batch.triangles),
            work=Buffer(self._device, "points", dtype("Work").itemsize),
            segments=Buffer(self._device, "points", 8 * segments),
        )

    def __call__(
        self, scene: SceneBuffers, batch: Batch, target: ViewTarget, band: Band, points: PointCloud
    ) -> None:
        """Fill `points` for one batch and band."""
        frame = {"FrameBlock": target.frame(band, batch)}
        self._span.set(
            {
                **batch.geometry(),
                **frame,
                "Draws": scene.draws,
                **batch.attributes(),
                **scene.materials_of(),
                "Spans": points.spans,
            }
        )
        self._span.run((-(-batch.triangles // _GROUP), 1, 1))

        segments = -(-batch.triangles // SEGMENT)
        groups = (-(-segments // _SEGMENT_GROUP), 1, 1)
        self._sum.set({**frame, "Spans": points.spans, "Segments": points.segments})
        self._sum.run(groups)
        self._scan.set(
            {"Segments": points.segments, "WorkBlock": points.work},
            {
                "segment_count": segments,
                "view_blocks": -(-target.rig.views // self._view_lanes),
            },
        )
        self._scan.run((1, 1, 1))
        self._compact.set(
            {
                **frame,
                "Spans": points.spans,
                "Segments": points.segments,
                "VisibleTriangles": points.visible,
            }
        )
        self._compact.run(groups)

    def count(
        self, scene: SceneBuffers, batch: Batch, target: ViewTarget, band: Band, points: PointCloud
    ) -> int:
        """Points of one batch and band. Samples, counts and waits: not for a frame."""
        self(scene, batch, target, band, points)
        self._total.fill(0)
        self._count.set(
            {
                **batch.geometry(),
                **points.blocks(),
                "Draws": scene.draws,
                "FrameBlock": target.frame(band, batch),
                "RowOffsets": target.row_offsets,
                "PointCount": self._total,
            }
        )
        self._count.run_indirect(points.work)
        return int(self._total.read(np.uint32)[0])

    def release(self) -> None:
        """Free the kernels."""
        for kernel in (self._span, self._sum, self._scan, self._compact, self._count):
            kernel.release()
        self._total.release()

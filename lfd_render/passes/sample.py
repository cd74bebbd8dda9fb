"""Sampling: triangles → rows of points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lfd_render.gpu.device import Device
from lfd_render.gpu.layout import dtype
from lfd_render.gpu.memory import Buffer
from lfd_render.gpu.programs import Kernel
from lfd_render.gpu.scene_buffers import Batch, SceneBuffers
from lfd_render.passes.view_target import Band

SEGMENT = 64  # triangles a thread of the prefix sum takes
GROUP_ROWS = 4  # rows of points a work group of the splatter takes
GROUPS_ACROSS = 32768  # work groups along x before y grows
MOST_WINDOW_ITEMS = 1 << 21  # rows of points that one buffer holds: 64 MiB
_HEADROOM = 1.25  # of a window over the items found, so that a moving scene rarely outgrows it
_SPAN_GROUP = 128  # local_size_x of sample/span.comp
_SEGMENT_GROUP = 64  # local_size_x of sample/sum.comp and sample/compact.comp
ROWS_DISPATCH = 12  # byte offset of rows_x within Work


@dataclass
class PointCloud:
    """Points of one batch and band. spans: Span [triangle]; visible: Visible [≤ triangles]; rows:
    PointRow [≤ window_items], one window of the items at a time; work: Work [window].

    A row holds the points of one triangle on one window row: cells, Span.point_columns long, of
    the densest eye's columns, which need no storage of their own.
    """

    spans: Buffer
    visible: Buffer
    segments: Buffer
    most_items: Buffer
    rows: Buffer
    work: Buffer
    window_items: int
    windows: int

    def release(self) -> None:
        """Free the buffers."""
        for buffer in (
            self.spans, self.visible, self.segments, self.most_items, self.rows, self.work,
        ):  # fmt: skip
            buffer.release()


class Sample:
    """Batch, Band → PointCloud.

    Clips at the near plane, culls triangles that no view faces or that reach no row centre, sets
    each triangle's point length (Gavane and Watson 2024, section 3.1), sums the rows and writes
    them out.
    """

    def __init__(
        self,
        device: Device,
        scene: SceneBuffers,
        view_lanes: int,
        *,
        stochastic_culling: bool = False,
        whole_rows: bool = False,
    ) -> None:
        """whole_rows: keep every row a triangle touches, for views that do not share their rows."""
        self._device = device
        self._scene = scene
        self._view_lanes = view_lanes
        constants = {
            "SEGMENT": SEGMENT,
            "GROUP_ROWS": GROUP_ROWS,
            "GROUPS_ACROSS": GROUPS_ACROSS,
        }
        self._span = Kernel(
            device,
            "sample/span.comp",
            {
                "STOCHASTIC_CULLING": int(stochastic_culling),
                "WHOLE_ROWS": int(whole_rows),
                **scene.constants(),
            },
        )
        self._sum = Kernel(device, "sample/sum.comp", constants)
        self._scan = Kernel(device, "sample/scan.comp", constants)
        self._compact = Kernel(device, "sample/compact.comp", constants)
        self._rows = Kernel(device, "sample/rows.comp", constants)
        self._count = Kernel(device, "sample/count.comp", constants)
        self._total = Buffer(device, "points", 4)

    def allocate(self, batch: Batch) -> PointCloud:
        """Buffers for a batch's points, with room for one row until `fit` enlarges it."""
        segments = -(-batch.triangles // SEGMENT)
        points = PointCloud(
            spans=Buffer(self._device, "points", dtype("Span").itemsize * batch.triangles),
            visible=Buffer(self._device, "points", dtype("Visible").itemsize * batch.triangles),
            segments=Buffer(self._device, "points", 8 * segments),
            most_items=Buffer(self._device, "points", 4),
            rows=Buffer(self._device, "point rows", dtype("PointRow").itemsize),
            work=Buffer(self._device, "points", dtype("Work").itemsize),
            window_items=1,
            windows=1,
        )
        points.most_items.fill(0)
        return points

    def fit(self, points: PointCloud) -> bool:
        """Enlarge the windows if the frames since the last call had more items than they hold.

        Returns whether they were too small, so that what was rendered must be rendered again.
        Waits for the device: call it when a frame is done.
        """
        most = int(points.most_items.read(np.uint32)[0])
        points.most_items.fill(0)
        if most <= points.window_items * points.windows:
            return False
        wanted = min(int(most * _HEADROOM), 0xFFFFFFFF - MOST_WINDOW_ITEMS)
        points.window_items = min(wanted, MOST_WINDOW_ITEMS)
        points.windows = -(-wanted // points.window_items)
        points.rows.release()
        points.work.release()
        # Work groups come in whole lines of GROUPS_ACROSS and load before they know their bounds.
        padding = GROUP_ROWS * (GROUPS_ACROSS if points.window_items > GROUPS_ACROSS else 1)
        row_bytes = dtype("PointRow").itemsize * (points.window_items + padding)
        points.rows = Buffer(self._device, "point rows", row_bytes)
        points.work = Buffer(self._device, "points", dtype("Work").itemsize * points.windows)
        return True

    def __call__(self, batch: Batch, points: PointCloud, band: Band) -> None:
        """Sample one batch and band: all but the rows, window by window."""
        frame = {"FrameBlock": band.frame(batch)}
        self._span.set(
            {
                **batch.geometry(),
                **batch.attributes(),
                **self._scene.materials_of(),
                **frame,
                "Draws": self._scene.draws,
                "Spans": points.spans,
            }
        )
        self._span.run((-(-batch.triangles // _SPAN_GROUP), 1, 1))

        segments = -(-batch.triangles // SEGMENT)
        groups = (-(-segments // _SEGMENT_GROUP), 1, 1)
        self._sum.set({**frame, "Spans": points.spans, "Segments": points.segments})
        self._sum.run(groups)
        self._scan.set(
            {
                "Segments": points.segments,
                "WorkBlock": points.work,
                "MostItems": points.most_items,
            },
            {
                "segment_count": segments,
                "view_blocks": -(-band.target.rig.views // self._view_lanes),
                "window_items": points.window_items,
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

    def rows(self, batch: Batch, points: PointCloud, band: Band, window: int) -> None:
        """Write the rows of one window of items."""
        self._rows.set(
            {
                **batch.geometry(),
                "Draws": self._scene.draws,
                "FrameBlock": band.frame(batch),
                "Spans": points.spans,
                "VisibleTriangles": points.visible,
                "WorkBlock": points.work,
                "RowOffsets": band.target.row_offsets,
                "PointRows": points.rows,
            },
            {"window": window},
        )
        self._rows.run_indirect(points.work, window * dtype("Work").itemsize + ROWS_DISPATCH)

    def count(self, batch: Batch, points: PointCloud, band: Band) -> int:
        """Points of one batch and band. Samples, counts and waits: not for a frame."""
        self._total.fill(0)
        self(batch, points, band)
        for window in range(points.windows):
            self.rows(batch, points, band, window)
            self._count.set(
                {
                    **batch.geometry(),
                    "Draws": self._scene.draws,
                    "FrameBlock": band.frame(batch),
                    "Spans": points.spans,
                    "PointRows": points.rows,
                    "WorkBlock": points.work,
                    "PointCount": self._total,
                },
                {"window": window},
            )
            self._count.run_indirect(points.work, window * dtype("Work").itemsize + ROWS_DISPATCH)
        return int(self._total.read(np.uint32)[0])

    def release(self) -> None:
        """Free the kernels."""
        for owner in (
            self._span, self._sum, self._scan, self._compact, self._rows, self._count, self._total,
        ):  # fmt: skip
            owner.release()

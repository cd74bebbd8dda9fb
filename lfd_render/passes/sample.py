"""Sampling: triangles → rows of points."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from lfd_render.gpu.device import Device
from lfd_render.gpu.layout import dtype
from lfd_render.gpu.memory import Buffer
from lfd_render.gpu.programs import Kernel
from lfd_render.gpu.scene_buffers import Batch, SceneBuffers
from lfd_render.passes.bin import Bin, Bins
from lfd_render.passes.items import (
    GROUP_ROWS,
    GROUPS_ACROSS,
    ITEM_STEP,
    ROWS_DISPATCH,
    CountItems,
    Items,
)
from lfd_render.passes.sampling import DEFAULT_SAMPLING, Sampling
from lfd_render.passes.view_target import Band

MOST_WINDOW_ITEMS = 1 << 21  # rows of points that one buffer holds: 64 MiB
HEADROOM = 1.25  # of a window over the items found, so that a moving scene rarely outgrows it
_SPAN_GROUP = 128  # local_size_x of sample/span.comp


@dataclass
class PointCloud(Items):
    """Points of one batch and band. rows: PointRow [≤ window_items], one window of the items at a
    time.

    A row holds the points of one triangle on one window row: cells, Span.point_columns long, of
    the densest eye's columns, which need no storage of their own. Rows are sorted by window row
    where there are bins.
    """

    rows: Buffer
    bins: Bins | None

    @property
    def sizes(self) -> Buffer:
        """Span [triangle], of which the second word is the length of its points."""
        return self.spans

    def splat_blocks(self) -> dict[str, Buffer]:
        """What splatting reads, by block name."""
        return {"PointRows": self.rows, "WorkBlock": self.work}

    def release(self) -> None:
        """Free the buffers."""
        super().release()
        self.rows.release()
        if self.bins:
            self.bins.release()


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
        sampling: Sampling = DEFAULT_SAMPLING,
        whole_rows: bool = False,
        binned_rows: int = 0,
    ) -> None:
        """whole_rows: keep every row a triangle touches, for views that do not share their rows.

        binned_rows: of a band, by which rows of points are then sorted.
        """
        assert sampling.lattice == "rows"
        self._device = device
        self._scene = scene
        constants = {
            "WHOLE_ROWS": int(whole_rows),
            "BINNED": int(binned_rows > 0),
            "GROUPS_ACROSS": GROUPS_ACROSS,
            "ITEM_STEP": ITEM_STEP,
            **sampling.constants(),
            **scene.constants(),
        }
        self._span = Kernel(device, "sample/span.comp", constants)
        self._items = CountItems(device, view_lanes)
        self._rows = Kernel(device, "sample/rows.comp", constants)
        self._count = Kernel(device, "sample/count.comp", constants)
        self._total = Buffer(device, "points", 4)
        self._binned_rows = binned_rows
        self._bin = Bin(device, binned_rows) if binned_rows else None

    def allocate(self, batch: Batch) -> PointCloud:
        """Buffers for a batch's points, with room for one row until `fit` enlarges it."""
        items = Items.of(self._device, batch)
        return PointCloud(
            **{f.name: getattr(items, f.name) for f in fields(Items)},
            rows=Buffer(self._device, "point rows", dtype("PointRow").itemsize),
            bins=Bins.of(self._device, self._binned_rows) if self._binned_rows else None,
        )

    def fit(self, points: PointCloud) -> bool:
        """Enlarge the windows if the frames since the last call had more items than they hold, and
        the room of bins.

        Returns whether they were too small, so that what was rendered must be rendered again.
        Waits for the device: call it when a frame is done.
        """
        short = points.bins is not None and points.bins.fit()
        most = points.take_most()
        if most <= points.window_items * points.windows:
            return short
        wanted = min(int(most * HEADROOM), 0xFFFFFFFF - MOST_WINDOW_ITEMS)
        window_items = min(wanted, MOST_WINDOW_ITEMS)
        points.divide(self._device, -(-wanted // window_items), window_items)
        points.rows.release()
        # Work groups come in whole lines of GROUPS_ACROSS and load before they know their bounds.
        padding = GROUP_ROWS * (GROUPS_ACROSS if points.window_items > GROUPS_ACROSS else 1)
        row_bytes = dtype("PointRow").itemsize * (points.window_items + padding)
        points.rows = Buffer(self._device, "point rows", row_bytes)
        return True

    def __call__(self, batch: Batch, points: PointCloud, band: Band) -> None:
        """Sample one batch and band: all but the rows, window by window."""
        self._span.set(
            {
                **batch.geometry(),
                **batch.attributes(),
                **self._scene.materials_of(),
                "FrameBlock": band.frame(batch),
                "Draws": self._scene.draws,
                "Spans": points.spans,
            }
        )
        self._span.run((-(-batch.triangles // _SPAN_GROUP), 1, 1))
        self._items(batch, points, band)

    def fill(self, batch: Batch, points: PointCloud, band: Band, window: int) -> None:
        """Write the rows of one window of items."""
        if self._bin and points.bins:
            self._bin(batch, points, points.bins, band, window)
        self._rows.set(
            {
                **batch.geometry(),
                "Draws": self._scene.draws,
                "FrameBlock": band.frame(batch),
                "Spans": points.spans,
                "VisibleTriangles": points.visible,
                "ItemStarts": points.starts,
                "WorkBlock": points.work,
                "RowOffsets": band.target.row_offsets,
                "Bins": points.bins.ends if points.bins else points.work,
                "PointRows": points.rows,
            },
            {"window": window},
        )
        self._rows.run_indirect(points.work, window * dtype("Work").itemsize + ROWS_DISPATCH)

    def count(self, batch: Batch, points: PointCloud, band: Band) -> int:
        """Points of a batch and band that was sampled last, and filled if it is one window. Counts
        and waits: not for a frame."""
        self._total.fill(0)
        for window in range(points.windows):
            if points.windows > 1:
                self.fill(batch, points, band, window)
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
        for owner in (self._span, self._items, self._rows, self._count, self._total):
            owner.release()
        if self._bin:
            self._bin.release()

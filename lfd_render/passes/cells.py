"""The paper's lattice: triangles → a list of points, each a cell of its triangle's own lattice."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from lfd_render.gpu.device import Device
from lfd_render.gpu.layout import CONSTANTS, dtype
from lfd_render.gpu.memory import Buffer
from lfd_render.gpu.programs import Kernel
from lfd_render.gpu.scene_buffers import Batch, SceneBuffers
from lfd_render.passes.items import GROUPS_ACROSS, ITEM_STEP, ROWS_DISPATCH, CountItems, Items
from lfd_render.passes.owned import column_loops, iterations_left
from lfd_render.passes.sample import HEADROOM
from lfd_render.passes.sampling import Sampling
from lfd_render.passes.splat import view_lanes
from lfd_render.passes.view_target import Band, ViewTarget

MOST_WINDOW_POINTS = 1 << 23  # that one list holds: 64 MiB, and above any one triangle's
assert CONSTANTS["MOST_CELLS"] ** 2 < MOST_WINDOW_POINTS
_SPAN_GROUP = 128  # local_size_x of cells/span.comp


@dataclass
class CellCloud:
    """Points of one batch and band. cells: Cell [≤ room], one window at a time, in any order; work:
    CellWork; steps_mm: float32 [triangle, 2], the lattice's; needs: CellNeeds; strips: how many
    strips of rows hold the tallest point.
    """

    cells: Buffer
    work: Buffer
    needs: Buffer
    steps_mm: Buffer
    room: int = 1
    windows: int = 1
    strips: int = 1
    items: Items | None = None

    @property
    def sizes(self) -> Buffer:
        """Steps of each triangle's lattice."""
        return self.steps_mm

    def splat_blocks(self) -> dict[str, Buffer]:
        """What splatting reads, by block name."""
        return {"Cells": self.cells, "CellWorkBlock": self.work, "LatticeSteps": self.steps_mm}

    def release(self) -> None:
        """Free the buffers."""
        for owner in (self.cells, self.work, self.needs, self.steps_mm, self.items):
            if owner is not None:
                owner.release()


def strip_rows(scene: SceneBuffers, target: ViewTarget) -> int:
    """Rows of a point that one invocation may splat, by what software devices loop over."""
    tested = any(batch.alpha_mode != "opaque" for batch in scene.batches)
    return iterations_left(target.grid.columns * column_loops(scene, tested=tested) + 2)


def strips(band: Band, points: CellCloud, rows: int) -> list[dict[str, int]]:
    """Uniforms of the dispatches that splat a band: one, or, where a point is taller than a strip
    of so many rows, one for each strip of the band, since points may stand anywhere."""
    step, end = (band.rows if points.strips == 1 else rows), band.first + band.rows
    return [
        {"first_row": first, "end_row": min(first + step, end)}
        for first in range(band.first, end, step)
    ]


class CellSource(ABC):
    """What both sources of cells share: the list, and learning how long it must be."""

    def __init__(
        self, device: Device, scene: SceneBuffers, target: ViewTarget, sampling: Sampling
    ) -> None:
        assert sampling.lattice == "paper"
        self._device = device
        self._scene = scene
        self._target = target
        self._strip_rows = strip_rows(scene, target)
        self._constants = {
            "WHOLE_ROWS": 0,
            "STRIP_ROWS": self._strip_rows,
            "GROUPS_ACROSS": GROUPS_ACROSS,
            "ITEM_STEP": ITEM_STEP,
            **sampling.constants(),
            **scene.constants(),
        }
        self._work = Kernel(device, "cells/work.comp", self._constants)
        self._no_work = np.zeros(1, dtype("CellWork"))

    def allocate(self, batch: Batch) -> CellCloud:
        """Buffers for a batch's points, with room for one until `fit` enlarges them."""
        points = CellCloud(
            cells=Buffer(self._device, "cells", dtype("Cell").itemsize),
            work=Buffer(self._device, "cells", dtype("CellWork").itemsize),
            needs=Buffer(self._device, "cells", dtype("CellNeeds").itemsize),
            steps_mm=Buffer(self._device, "cells", 8 * batch.triangles),
        )
        points.needs.fill(0)
        return points

    @abstractmethod
    def __call__(self, batch: Batch, points: CellCloud, band: Band) -> None:
        """Sample one batch and band: all but the points, window by window."""

    @abstractmethod
    def _append(self, batch: Batch, points: CellCloud, band: Band, window: int) -> None:
        """Append the points of a window to the empty list."""

    @abstractmethod
    def _divide(self, points: CellCloud) -> None:
        """Make windows half as large."""

    def fill(self, batch: Batch, points: CellCloud, band: Band, window: int) -> None:
        """List the points of one window."""
        points.work.write(self._no_work)
        self._append(batch, points, band, window)
        views = self._target.rig.views
        self._work.set(
            {"CellWorkBlock": points.work, "CellNeedsBlock": points.needs},
            {"room": points.room, "view_blocks": -(-views // view_lanes(views))},
        )
        self._work.run((1, 1, 1))

    def fit(self, points: CellCloud) -> bool:
        """Make room for the most points since the last call; whether there was too little.

        Waits for the device: call it when a frame is done.
        """
        most, tallest = (int(n) for n in points.needs.read(np.uint32))
        points.needs.fill(0)
        short = most > points.room or tallest > points.strips * self._strip_rows
        points.strips = max(points.strips, -(-tallest // self._strip_rows))
        if most > points.room:
            if most > MOST_WINDOW_POINTS:
                self._divide(points)
            points.room = min(int(most * HEADROOM), MOST_WINDOW_POINTS)
            points.cells.release()
            points.cells = Buffer(self._device, "cells", dtype("Cell").itemsize * points.room)
        return short

    def count(self, batch: Batch, points: CellCloud, band: Band) -> int:
        """Points of a batch and band that was sampled last, and filled if it is one window. Counts
        and waits: not for a frame."""
        total = 0
        for window in range(points.windows):
            if points.windows > 1:
                self.fill(batch, points, band, window)
            total += int(points.work.read(dtype("CellWork"))["points"][0])
        return total

    def release(self) -> None:
        """Free the kernels."""
        self._work.release()


class SampleCells(CellSource):
    """Batch, Band → CellCloud, in compute: one thread a row of a triangle's lattice."""

    def __init__(
        self, device: Device, scene: SceneBuffers, target: ViewTarget, sampling: Sampling
    ) -> None:
        super().__init__(device, scene, target, sampling)
        self._span = Kernel(device, "cells/span.comp", self._constants)
        self._items = CountItems(device, view_lanes(target.rig.views))
        self._fill = Kernel(device, "cells/fill.comp", self._constants)

    def allocate(self, batch: Batch) -> CellCloud:
        """As the base's, with items that are rows of lattices."""
        points = super().allocate(batch)
        points.items = Items.of(self._device, batch)
        return points

    def __call__(self, batch: Batch, points: CellCloud, band: Band) -> None:
        """Cull triangles, choose their lattices' steps and count their rows."""
        assert points.items is not None
        self._span.set(
            {
                **batch.geometry(),
                **batch.attributes(),
                **self._scene.materials_of(),
                "FrameBlock": band.frame(batch),
                "Draws": self._scene.draws,
                "Eyes": band.target.eyes,
                "Spans": points.items.spans,
                "LatticeSteps": points.steps_mm,
            }
        )
        self._span.run((-(-batch.triangles // _SPAN_GROUP), 1, 1))
        self._items(batch, points.items, band)

    def _append(self, batch: Batch, points: CellCloud, band: Band, window: int) -> None:
        assert points.items is not None
        self._fill.set(
            {
                **batch.geometry(),
                "Draws": self._scene.draws,
                "FrameBlock": band.frame(batch),
                "Spans": points.items.spans,
                "VisibleTriangles": points.items.visible,
                "ItemStarts": points.items.starts,
                "WorkBlock": points.items.work,
                **points.splat_blocks(),
            },
            {"window": window, "room": points.room},
        )
        self._fill.run_indirect(points.items.work, window * dtype("Work").itemsize + ROWS_DISPATCH)

    def fit(self, points: CellCloud) -> bool:
        """As the base's; windows also hold all items."""
        assert points.items is not None
        most = points.items.take_most()
        short = super().fit(points)
        if most <= points.items.window_items * points.windows:
            return short
        window_items = -(-int(most * HEADROOM) // points.windows)
        points.items.divide(self._device, points.windows, window_items)
        return True

    def _divide(self, points: CellCloud) -> None:
        assert points.items is not None
        points.windows *= 2
        items = max(1, -(-points.items.window_items // 2))
        points.items.divide(self._device, points.windows, items)

    def release(self) -> None:
        """Free the kernels."""
        super().release()
        for owner in (self._span, self._items, self._fill):
            owner.release()

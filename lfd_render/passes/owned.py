"""Splatting without atomics: a work group owns a row of the band and a block of views."""

from __future__ import annotations

import math

import numpy as np

from lfd_render.gpu.device import Device
from lfd_render.gpu.layout import CONSTANTS, lod_constants
from lfd_render.gpu.memory import Buffer
from lfd_render.gpu.programs import Kernel, Samplers, Uniform
from lfd_render.gpu.scene_buffers import Batch, SceneBuffers
from lfd_render.passes.sample import PointCloud
from lfd_render.passes.sampling import DEFAULT_SAMPLING, Sampling
from lfd_render.passes.splat import view_lanes
from lfd_render.passes.view_buffers import ViewBuffers
from lfd_render.passes.view_target import Band, ViewTarget

MOST_LANE_VIEWS = 3  # that a lane takes, so that it loads a row of points once for all
MOST_ITERATIONS = 65535  # llvmpipe ends an invocation's loops here, nested ones counted together


def column_loops(scene: SceneBuffers, *, tested: bool) -> int:
    """Loop iterations of a column: one whose alpha is tested also looks for its texture's array,
    twice, and takes one tap."""
    return 2 + 2 * int(scene.constants()["SRGB_GROUPS"]) if tested else 1


def iterations_left(each: int) -> int:
    """How often an invocation may do what loops so many times, at least once."""
    return max(1, MOST_ITERATIONS // each)


class OwnedSplat:
    """PointCloud, ViewTarget → PackedViewBuffers, with the bits that `Splat` finds by atomics."""

    steps = range(1)

    def __init__(
        self,
        device: Device,
        scene: SceneBuffers,
        target: ViewTarget,
        *,
        lod: str = "area",
        sampling: Sampling = DEFAULT_SAMPLING,
    ) -> None:
        """lod: one of LOD_RULES, for alpha."""
        self._device, self._scene = device, scene
        views = target.rig.views
        lane_views = min(MOST_LANE_VIEWS, -(-views // 8))
        self._lanes = view_lanes(-(-views // lane_views))
        self._view_blocks = -(-views // (self._lanes * lane_views))
        constants = {**scene.constants(), **lod_constants(lod), **sampling.constants()}
        self._rounds = Buffer(device, "bins", 24)  # of one round
        lanes = target.band_rows * self._view_blocks * self._lanes
        self._progress = Buffer(device, "bins", 4 * lanes)
        tested = {batch.alpha_mode != "opaque" for batch in scene.batches}
        assert target.grid.columns < 1 << (32 - CONSTANTS["COLUMNS_SHIFT"])
        loops = {key: lane_views * column_loops(scene, tested=key) for key in tested}
        each = {key: target.grid.columns * loops[key] + 2 for key in tested}  # of an item, at most
        self._round_items = {key: iterations_left(each[key]) for key in tested}  # at least
        self._kernels = {
            key: Kernel(
                device,
                "splat/owned.comp",
                {
                    **constants,
                    "VIEW_LANES": self._lanes,
                    "LANE_VIEWS": lane_views,
                    "COLUMN_LOOPS": loops[key],
                    "MOST_SPENT": max(0, MOST_ITERATIONS - each[key]),
                    "ALPHA_TESTED": int(key),
                },
            )
            for key in sorted(tested)
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
        """Splat one window of points, as much of each bin as the sampler has made room for."""
        assert step in self.steps
        assert points.bins
        tested = batch.alpha_mode != "opaque"
        kernel = self._kernels[tested]
        buffers = {
            **batch.geometry(),
            **batch.attributes(),
            **self._scene.materials_of(),
            **views.blocks(),
            "Draws": self._scene.draws,
            "FrameBlock": band.frame(batch),
            "Bins": points.bins.ends,
            "Progress": self._progress,
            "Eyes": band.target.eyes,
            "RowOffsets": band.target.row_offsets,
        }
        samplers: Samplers = {**self._scene.samplers(), "binned_rows": points.rows}
        rounds = -(-points.bins.room // self._round_items[tested])
        uniforms: dict[str, Uniform] = {"row_stride": coprime_stride(band.rows), "round_index": 0}
        self._begin(rounds, band.rows)
        kernel.set({**buffers, "Rounds": self._rounds}, uniforms, samplers)
        for index in range(rounds):
            kernel.change("round_index", index)
            kernel.run_indirect(self._rounds, 12 * index)

    def _begin(self, rounds: int, rows: int) -> None:
        """Work groups for the first round; those of later ones come from what it leaves."""
        groups = np.zeros((rounds + 1, 3), np.uint32)
        groups[:, 1:] = self._view_blocks, 1
        groups[0, 0] = rows
        if self._rounds.size < groups.nbytes:
            self._rounds.release()
            self._rounds = Buffer(self._device, "bins", groups.nbytes)
        self._rounds.write(groups)
        self._progress.fill(0)

    def release(self) -> None:
        """Free kernels and buffers."""
        for owner in (self._rounds, self._progress):
            owner.release()
        for kernel in self._kernels.values():
            kernel.release()


def coprime_stride(count: int) -> int:
    """A step, near the golden section of `count`, that visits all of 0…count − 1 once modulo it."""
    stride = max(1, round(0.618 * count))
    while math.gcd(stride, count) > 1:
        stride += 1
    return stride

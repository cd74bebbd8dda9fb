"""Shading that views share: what of a surface's light does not depend on the eye, once for all."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np

from lfd_render.gpu.device import Device
from lfd_render.gpu.layout import CONSTANTS, dtype, lod_constants
from lfd_render.gpu.memory import Buffer
from lfd_render.gpu.programs import Kernel, Uniform
from lfd_render.gpu.scene_buffers import Batch, SceneBuffers
from lfd_render.passes.blocks import Blocks, block_constants
from lfd_render.passes.items import GROUPS_ACROSS
from lfd_render.passes.placement import Placement, gl_matrix
from lfd_render.passes.prefix_sum import PrefixSum
from lfd_render.passes.sampling import DEFAULT_SAMPLING, Points, Sampling
from lfd_render.passes.view_buffers import ViewBuffers
from lfd_render.passes.view_target import Band, ViewTarget

MOST_GROUPS = 16  # of views, by which a triangle's tracks divide them
# Of a part of a band: 120 MiB with what they show and the list of those shown.
MOST_TRACKS = 5 << 20
_FIRST_TRACK = 1 << 31  # words below name triangles, the others tracks
MOST_CELLS = 7 << 20  # of a part: 112 MiB
PIXELS_A_TRACK, PIXELS_A_CELL = 16, 8  # room at first, which suits scenes that fill the views
HEADROOM = 1.25
MANY_LIGHTS = 8  # with so many a scene without textures takes as long either way
MANY_VIEWS = 8  # with so many a scene with textures does
_GROUP = 64  # local_size_x of the steps that take triangles or cells
_LISTED_TRACKS = 512  # that a work group of share/shown.comp looks through for those shown


def pays(scene: SceneBuffers, views: int) -> bool:
    """Whether sharing takes less time than shading each pixel by its ray: where there are textures
    to filter, or many lights, and many views that share."""
    textures, lights = scene.constants()["ROLES"], scene.lighting.constants()["LIGHTS"]
    return views >= MANY_VIEWS and bool(textures or lights >= MANY_LIGHTS)


class _Owner(Protocol):
    def release(self) -> None: ...


class SharedShade:
    """ViewBuffers, ViewTarget → ViewTarget.images, by slice tracks: what a window row cuts from a
    triangle, over a group of views that see it about equally dense.

    What of a surface's light does not depend on the eye, textures and all, is shaded on the columns
    of the group's middle view where some pixel of the group shows it. Each pixel mixes the two
    columns about its place there, which its depth tells, and adds its own gloss.
    """

    def __init__(
        self,
        device: Device,
        scene: SceneBuffers,
        target: ViewTarget,
        word_stride: int,
        *,
        lod: str = "area",
        sampling: Sampling = DEFAULT_SAMPLING,
    ) -> None:
        """lod: one of LOD_RULES."""
        constants = {
            **block_constants(device),
            "WORD_STRIDE": word_stride,
            "GROUPS_ACROSS": GROUPS_ACROSS,
            "THREADS": device.threads,
            "ENCODED": int(target.encoded),
            "MOST_GROUPS": MOST_GROUPS,
            **scene.constants(),
            **scene.lighting.constants(),
            **lod_constants(lod),
            **sampling.constants(),
        }
        self._device, self._scene = device, scene
        self._blocks = Blocks(device, target, word_stride, mark=True)
        self._tracks = Kernel(device, "share/tracks.comp", constants)
        self._mark = Kernel(device, "share/mark.comp", constants)
        self._list = Kernel(
            device, "share/shown.comp", {**constants, "GROUP_TRACKS": _LISTED_TRACKS}
        )
        self._places = Kernel(device, "share/places.comp", constants)
        self._matte = Kernel(device, "share/matte.comp", constants)
        self._light = Kernel(device, "share/light.comp", constants)
        self._sum = PrefixSum(device, stride=2, group=_LISTED_TRACKS)
        triangles = max((batch.triangles for batch in scene.batches), default=0)
        # Two words a triangle; those of two triangles are fetched at once.
        self._of_triangles = Buffer(device, "slice tracks", 8 * (triangles + triangles % 2))
        words = CONSTANTS["NO_TRIANGLE"] - _FIRST_TRACK
        self._most_tracks = min(MOST_TRACKS, words // max(1, len(scene.batches)))
        self._first_track = {
            batch.triangle_base: _FIRST_TRACK + i * self._most_tracks
            for i, batch in enumerate(scene.batches)
        }
        self._triangles = {
            count: Buffer.of(device, "slice tracks", np.array([count], np.uint32))
            for count in {batch.triangles for batch in scene.batches}
        }
        self._work = Buffer(device, "shared cells", dtype("SharedWork").itemsize)
        self._work.fill(0)
        self._listed = Buffer(device, "slice tracks", dtype("TrackWork").itemsize)
        self._no_work = np.array([0, 0, 1, 0], np.uint32)  # without the most cells
        self._parts = 1  # of a band, so that each fits
        pixels = target.band_pixels
        self._make_room(pixels // PIXELS_A_TRACK, pixels // PIXELS_A_CELL)

    def _make_room(self, tracks: int, cells: int) -> None:
        device = self._device
        self._room = (min(max(tracks, 1), self._most_tracks), min(max(cells, 1), MOST_CELLS))
        tracks, cells = self._room
        self._shown = Buffer(device, "slice tracks", 4 * tracks)
        self._track_list = Buffer(device, "slice tracks", 4 * tracks)
        self._track_records = Buffer(device, "slice tracks", dtype("Track").itemsize * tracks)
        self._cells = Buffer(device, "shared cells", 16 * cells)

    def opaque(
        self,
        batches: Sequence[tuple[Batch, Points]],
        band: Band,
        views: ViewBuffers,
        placement: Placement,
    ) -> None:
        """Shade a band over the background, as `Shade.opaque` does.
        batches: each with the points, on rows, that it was sampled by."""
        turn: dict[str, Uniform] = {"turn_from_display": gl_matrix(placement.turn_from_display)}
        uniforms = turn | band.target.shaded(placement)
        parts = min(self._parts, band.rows)
        for part in range(parts):
            rows = (part * band.rows // parts, (part + 1) * band.rows // parts)
            for batch, points in batches:
                self._shade(batch, points, band, views, uniforms, rows=rows)

    def _shade(
        self,
        batch: Batch,
        points: Points,
        band: Band,
        views: ViewBuffers,
        uniforms: Mapping[str, Uniform],
        *,
        rows: tuple[int, int],
    ) -> None:
        """Shade what some rows of a band, [first, end), show of a batch. uniforms: the turn and
        what storing needs to know."""
        frame = {"FrameBlock": band.frame(batch)}
        eyes = {"Eyes": band.target.eyes, "RowOffsets": band.target.row_offsets}
        geometry = {**frame, **batch.geometry(), "Draws": self._scene.draws}
        of_triangles = {"TriangleTracks": self._of_triangles}
        cells = {"Tracks": self._track_records, "Cells": self._cells}
        work = {"SharedWorkBlock": self._work}
        lighting = self._scene.lighting

        self._of_triangles.fill(0)
        listed = self._blocks(batch, band, views, rows=rows, shown=self._of_triangles)
        self._tracks.set(
            {**geometry, **of_triangles, "Spans": points.sizes, "Eyes": eyes["Eyes"]},
            {"first_row": band.first + rows[0], "end_row": band.first + rows[1]},
        )
        self._tracks.run((-(-batch.triangles // _GROUP), 1, 1))
        self._sum(self._of_triangles, self._triangles[batch.triangles], self._room[0])

        self._shown.fill(0)
        named: dict[str, Uniform] = {"first_track": self._first_track[batch.triangle_base]}
        self._mark.set({**frame, **listed, **of_triangles, "Shown": self._shown}, named)
        self._mark.run_indirect(self._blocks.work)

        self._listed.write(self._no_work)
        shown = {
            "Shown": self._shown,
            "TrackList": self._track_list,
            "TrackWorkBlock": self._listed,
        }
        self._list.set({**shown, "TrackTotal": self._sum.total})
        self._list.run_indirect(self._sum.dispatch)

        self._work.write(self._no_work)
        self._places.set({**geometry, **of_triangles, **shown, **eyes, **cells, **work})
        self._places.run_indirect(self._listed)

        self._matte.set(
            {
                **geometry,
                **batch.attributes(),
                **self._scene.materials_of(),
                **lighting.buffers(),
                **eyes,
                "PointSizes": points.sizes,
                **work,
                "Cells": self._cells,
            },
            {"turn_from_display": uniforms["turn_from_display"]},
            {**self._scene.samplers(), **lighting.samplers()},
        )
        self._matte.run_indirect(self._work)
        self._light.set(
            {
                **frame,
                **listed,
                **cells,
                **lighting.buffers(),
                "Depths": views.depths,
            },
            {**uniforms, **named, "most_tracks": self._room[0]},
            lighting.samplers(),
        )
        self._light.run_indirect(self._blocks.work)

    def fit(self) -> bool:
        """Make room for the tracks and cells of frames since the last call; whether there was too
        little. Waits for the device."""
        tracks, cells = (
            self._sum.take_most(),
            int(self._work.read(dtype("SharedWork"))["most_cells"][0]),
        )
        self._work.fill(0)
        if tracks <= self._room[0] and cells <= self._room[1]:
            return False
        for owner in (self._shown, self._track_list, self._track_records, self._cells):
            owner.release()
        wanted = (int(tracks * HEADROOM), int(cells * HEADROOM))
        parts = max(wanted[0] / self._most_tracks, wanted[1] / MOST_CELLS)
        self._parts = math.ceil(self._parts * max(1.0, parts))
        self._make_room(max(self._room[0], wanted[0]), max(self._room[1], wanted[1]))
        return True

    def release(self) -> None:
        """Free kernels and buffers."""
        owners: tuple[_Owner, ...] = (
            self._blocks, self._sum,
            self._tracks, self._mark, self._list, self._places, self._matte, self._light,
            self._of_triangles, *self._triangles.values(), self._work,
            self._listed, self._shown, self._track_list, self._track_records, self._cells,
        )  # fmt: skip
        for owner in owners:
            owner.release()

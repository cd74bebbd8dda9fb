"""Shading: the winner of each view pixel → its scene-linear colour."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from lfd_render.gpu.device import Device
from lfd_render.gpu.layout import lod_constants
from lfd_render.gpu.memory import Buffer
from lfd_render.gpu.programs import Kernel, Uniform
from lfd_render.gpu.scene_buffers import Batch, SceneBuffers
from lfd_render.passes.blocks import Blocks, block_constants
from lfd_render.passes.items import GROUPS_ACROSS
from lfd_render.passes.placement import Placement, gl_matrix
from lfd_render.passes.sampling import DEFAULT_SAMPLING, Sampling
from lfd_render.passes.view_buffers import Winners
from lfd_render.passes.view_target import Band, ViewTarget


class Sized(Protocol):
    """What shading reads of a batch's points."""

    @property
    def sizes(self) -> Buffer:
        """As `Points.sizes`."""
        ...


class NoPoints:
    """What stands for points where triangles were rasterised: no rule that reads sizes is used."""

    def __init__(self, device: Device) -> None:
        self.sizes = Buffer(device, "no points", 8)

    def release(self) -> None:
        """Free the buffer."""
        self.sizes.release()


Sampled = tuple[Batch, Sized]


class Shade:
    """Winners, ViewTarget → ViewTarget.images: each visible pixel is shaded once, where its ray
    meets the triangle that its word names. `blend` lays the nearest blended surface over it."""

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
            "ENCODED": int(target.encoded),
            **scene.constants(),
            **scene.lighting.constants(),
            **lod_constants(lod),
            **sampling.constants(),
        }
        self._scene = scene
        self._blocks = Blocks(device, target, word_stride)
        self._opaque = Kernel(device, "shade/ray.comp", constants)
        self._blend = Kernel(device, "shade/blend.comp", constants)

    def opaque(
        self, batches: Sequence[Sampled], band: Band, views: Winners, placement: Placement
    ) -> None:
        """Shade a band over the background. batches: each with the points it was sampled by."""
        known = band.target.shaded(placement)
        self._run(self._opaque, batches, band, views, {**_turn(placement), **known})

    def blend(
        self, batches: Sequence[Sampled], band: Band, views: Winners, placement: Placement
    ) -> None:
        """Lay the blended surfaces that `views` now names over the band's images."""
        assert not band.target.encoded
        band.target.images.bind_image(0, writeonly=False)
        self._run(self._blend, batches, band, views, _turn(placement))

    def _run(
        self,
        kernel: Kernel,
        batches: Sequence[Sampled],
        band: Band,
        views: Winners,
        uniforms: Mapping[str, Uniform],
    ) -> None:
        for batch, points in batches:
            shown = self._blocks(batch, band, views)
            kernel.set(
                {
                    "FrameBlock": band.frame(batch),
                    **shown,
                    **batch.geometry(),
                    **batch.attributes(),
                    **self._scene.materials_of(),
                    **self._scene.lighting.buffers(),
                    "Draws": self._scene.draws,
                    "Eyes": band.target.eyes,
                    "RowOffsets": band.target.row_offsets,
                    "PointSizes": points.sizes,
                },
                uniforms,
                {**self._scene.samplers(), **self._scene.lighting.samplers()},
            )
            kernel.run_indirect(self._blocks.work)

    def release(self) -> None:
        """Free kernels and the list."""
        for owner in (self._blocks, self._opaque, self._blend):
            owner.release()


def _turn(placement: Placement) -> dict[str, Uniform]:
    return {"turn_from_display": gl_matrix(placement.turn_from_display)}

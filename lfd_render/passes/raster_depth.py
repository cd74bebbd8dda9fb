"""Shadow maps: the nearest depth as each of many spots sees it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lfd_render.gpu import raw as gl
from lfd_render.gpu.device import Device
from lfd_render.gpu.layout import dtype, lod_constants
from lfd_render.gpu.memory import Buffer
from lfd_render.gpu.scene_buffers import SceneBuffers
from lfd_render.passes.pipelines import BARE, PLAIN, SHADED, Parts, Pipeline
from lfd_render.passes.placement import Placement
from lfd_render.passes.raster import BLENDED, SOLID, Raster
from lfd_render.passes.raster_views import place_parts


@dataclass(frozen=True, eq=False)
class Spots:
    """Square frusta. eyes, toward: world, [spot, xyz], toward of any length; angle_rad: from side
    to side; near: the least depth seen, along `toward`, in the world's unit."""

    eyes: NDArray[np.float64]
    toward: NDArray[np.float64]
    angle_rad: float
    near: float

    @classmethod
    def scattered(
        cls, bounds: tuple[NDArray[np.floating], NDArray[np.floating]], count: int, seed: int = 0
    ) -> Spots:
        """So many of a right angle, at random places in a box and in random directions, as the
        catalogue measures (section 4)."""
        rng = np.random.default_rng(seed)
        low, high = (np.asarray(corner, np.float64) for corner in bounds)
        near = 1e-3 * float(np.linalg.norm(high - low))
        return cls(rng.uniform(low, high, (count, 3)), rng.normal(size=(count, 3)), np.pi / 2, near)

    def clip_from_world(self) -> NDArray[np.float64]:
        """[spot, 4, 4]: row 0 of a raster is its top, depth d becomes d − 2·near over d."""
        ahead = self.toward / np.linalg.norm(self.toward, axis=1, keepdims=True)
        upright = np.abs(ahead[:, 1:2]) < 0.99  # else the world's y is no use
        up = np.where(upright, (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
        right = np.cross(ahead, up)
        right /= np.linalg.norm(right, axis=1, keepdims=True)
        scale = 1.0 / np.tan(0.5 * self.angle_rad)
        axes = np.stack([scale * right, scale * np.cross(ahead, right), ahead, ahead], axis=1)
        shifts = -np.einsum("nij,nj->ni", axes, self.eyes) - [0.0, 0.0, 2.0 * self.near, 0.0]
        return np.concatenate([axes, shifts[:, :, None]], axis=2)


class RasterDepth:
    """SceneBuffers placed in the world, Spots → depth maps; blended surfaces cast shadows where
    their alpha shows at all."""

    def __init__(
        self,
        device: Device,
        scene: SceneBuffers,
        count: int,
        size: tuple[int, int],
        *,
        lod: str = "area",
        pipeline: Pipeline = PLAIN,
    ) -> None:
        """count: of spots; size: columns and rows of a map; lod: what alpha is tested by."""
        opaque = all(batch.alpha_mode == "opaque" for batch in scene.batches)
        self.parts = Parts.of(pipeline, count, *size)
        self._raster = Raster(
            device, scene, self.parts, pipeline=pipeline, fragment="raster/ids.frag", colors=[],
            constants={**scene.lighting.constants(), **lod_constants(lod)},
            components=BARE if opaque else SHADED, keep_depth=True,
        )  # fmt: skip
        self._views = Buffer(device, "spots", count * dtype("RasterView").itemsize)
        self._placement = Placement(np.eye(4), (0.0, 0.0, 0.0))

    def __call__(self, spots: Spots) -> None:
        """Draw all maps; `scene.place` has made the world display space."""
        assert len(spots.eyes) == self.parts.views
        self._near = spots.near
        records = np.zeros(self.parts.views, dtype("RasterView"))
        records["clip_from_display"] = spots.clip_from_world().transpose(0, 2, 1).reshape(-1, 16)
        records["left"] = records["right"] = 0.0, 0.0, 0.0, 1.0  # clip nothing
        records["eye"][:, :3] = spots.eyes
        place_parts(records, self._raster.pipeline, self.parts, self.parts.rows)
        self._views.write(records)
        modes = (*SOLID, *BLENDED)
        with self._raster.rasterising():
            for step in range(len(self._raster.passes)):
                self._raster.clear(step, 0)
                self._raster.draw(step, modes, self._views, self.parts.rows, self._placement)

    def read(self) -> NDArray[np.float32]:
        """Depths along the spots' axes, [spot, y, x], in the world's unit; ∞ where nothing is."""
        maps = self._raster.depth.read(np.float32, gl.FLOAT, channels=gl.DEPTH_COMPONENT)
        with np.errstate(divide="ignore"):
            return np.asarray(self._near / (1.0 - self.parts.split(maps)), np.float32)

    def release(self) -> None:
        """Free the raster and the views."""
        self._raster.release()
        self._views.release()

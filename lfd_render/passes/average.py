"""Averaging: supersampled view images → view images."""

from __future__ import annotations

from lfd_render.gpu import raw as gl
from lfd_render.gpu.device import Device
from lfd_render.gpu.framebuffer import LayerTarget
from lfd_render.gpu.memory import TextureArray
from lfd_render.gpu.programs import Uniform
from lfd_render.passes.screen import ScreenPass
from lfd_render.passes.view_target import Band, ViewImages, ViewTarget


class Average:
    """Bands of a target with `eyes` eyes a view and `times` × `times` pixels a pixel → the views,
    each pixel the mean of its samples in linear light."""

    def __init__(self, device: Device, target: ViewTarget, *, eyes: int, times: int) -> None:
        assert target.rig.views % eyes == target.band_rows % times == 0
        self._eyes, self._times = eyes, times
        self._pass = ScreenPass(device, "average/average.frag", {"EYES": eyes, "TIMES": times})
        size = (target.grid.columns // times, target.band_rows // times, target.rig.views // eyes)
        self.images = TextureArray(device, "averaged views", size, gl.RGBA16F)
        self.images.parameters(gl.NEAREST, gl.NEAREST, ("clamp", "clamp"))
        self._layer = LayerTarget(device, self.images)

    def __call__(self, band: Band) -> ViewImages:
        """Average a band."""
        rows = band.rows // self._times
        band.target.images.bind_image(0, writeonly=False)
        for view in range(self.images.layers):
            self._layer.use(view)
            uniforms: dict[str, Uniform] = {"first_eye": view * self._eyes}
            self._pass({}, uniforms, {}, (0, rows), self.images.width)
        shown = (band.shown[0] // self._times, band.shown[1] // self._times)
        return ViewImages(self.images, band.first // self._times, shown)

    def release(self) -> None:
        """Free everything."""
        self._layer.release()
        self.images.release()
        self._pass.release()

"""The last stages of a frame: bands of view images become the encoded panel image.

Where each subpixel shows one view pixel as it is, views are encoded first, where they are shaded if
nothing else is asked of them, and woven as bytes, which moves half as much. Where view pixels are
mixed, they are mixed in linear light and encoded on the panel, unless asked to be mixed as codes.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import DisplayProfile, Reconstruction, ViewGrid
from lfd_render.gpu.clock import StageClock
from lfd_render.gpu.device import Device
from lfd_render.passes.average import Average
from lfd_render.passes.encode import Encode
from lfd_render.passes.encode_views import EncodeViews
from lfd_render.passes.view_target import Band, ViewTarget
from lfd_render.passes.weave import Weave, is_exact

LIGHTS = ("linear", "encoded")


@dataclass(frozen=True)
class PanelOptions:
    """rule: how views are put together; eyes: how many make up a view; light: what a filter
    averages, of LIGHTS; linear: whether scene-linear panel pixels are asked for beside the encoded
    ones."""

    rule: Reconstruction = field(default_factory=Reconstruction)
    eyes: int = 1
    light: str = "linear"
    linear: bool = True


def codes_first(options: PanelOptions, grid: ViewGrid) -> bool:
    """Whether views of a grid are encoded before they are woven."""
    exact = is_exact(options.rule, grid)
    return options.light == "encoded" or (exact and not options.linear)


def codes_alone(options: PanelOptions, grid: ViewGrid, *, times: int) -> bool:
    """Whether nothing is asked of a grid's views but codes. times: view rows of the target a row of
    the grid."""
    return codes_first(options, grid) and not options.linear and max(options.eyes, times) == 1


class PanelStage:
    """Bands of view images → the panel image, encoded and, where asked for, in linear light."""

    def __init__(
        self,
        device: Device,
        display: DisplayProfile,
        grid: ViewGrid,
        target: ViewTarget,
        options: PanelOptions,
    ) -> None:
        """grid: the pixels of the views that are woven, of which the target's may be finer."""
        self._options = options
        views = target.rig.views // options.eyes
        times = target.grid.rows // grid.rows
        self._average: Average | None = None
        if max(options.eyes, times) > 1:
            self._average = Average(device, target, eyes=options.eyes, times=times)
        encoded_first = codes_first(options, grid)
        assert not target.encoded or codes_alone(options, grid, times=times)
        self._encode_views: EncodeViews | None = None
        self._codes: Weave | None = None
        self._weave: Weave | None = None
        self._encode: Encode | None = None
        if encoded_first and not target.encoded:
            self._encode_views = EncodeViews(
                device, (grid.columns, target.band_rows // times, views)
            )
        if encoded_first:
            self._codes = Weave(device, display, grid, views, options.rule, encoded=True)
        if options.linear or not encoded_first:
            self._weave = Weave(device, display, grid, views, options.rule)
        if not encoded_first:
            self._encode = Encode(device, *display.resolution_px)

    def band(self, band: Band, clock: StageClock, exposure: float) -> None:
        """Weave what a band of view images shows."""
        images = band.view_images()
        if self._average:
            with clock.stage("average"):
                images = self._average(band)
        if self._codes:
            encoded = images
            if self._encode_views:
                with clock.stage("encode_srgb"):
                    encoded = self._encode_views(images, exposure)
            with clock.stage("weave"):
                self._codes(encoded)
        if self._weave:
            with clock.stage("weave"):
                self._weave(images)

    def finish(self, clock: StageClock, exposure: float) -> None:
        """What is left to do when all bands are woven."""
        if self._encode and self._weave:
            with clock.stage("encode_srgb"):
                self._encode(self._weave.panel, 0, exposure)

    def read(self) -> tuple[NDArray[np.float16] | None, NDArray[np.uint8]]:
        """The panel image, [y, x, 3]: in linear light if asked for, and encoded."""
        linear = self._weave.read_linear() if self._weave and self._options.linear else None
        if self._codes:
            return linear, self._codes.read_encoded()
        assert self._encode
        return linear, self._encode.read()

    def release(self) -> None:
        """Free everything."""
        for owner in (self._average, self._encode_views, self._codes, self._weave, self._encode):
            if owner:
                owner.release()

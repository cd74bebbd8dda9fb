"""Weaving pictures of views into a panel image, on the device."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import DisplayProfile, Reconstruction, ViewGrid
from lfd_render.errors import UsageError
from lfd_render.gpu import raw as gl
from lfd_render.gpu.device import Device
from lfd_render.gpu.memory import TextureArray
from lfd_render.passes.encode import Encode
from lfd_render.passes.view_target import BAND_BYTES, ViewImages
from lfd_render.passes.weave import NEAREST, Weave


def weave_pictures(
    device: Device,
    views: NDArray[np.uint8],
    display: DisplayProfile,
    grid: ViewGrid,
    *,
    rule: Reconstruction = NEAREST,
    light: str = "linear",
) -> tuple[NDArray[np.uint8], NDArray[np.float16] | None]:
    """Panel image of views uint8 [view, row, column, 3] in sRGB, view 0 leftmost: uint8 sRGB and
    float16 linear light, [y, x, 3].

    light: what is mixed, linear light or "encoded" codes; from codes there is no linear light.
    Where views follow the lenses and are not filtered nothing is mixed, and each subpixel has its
    view pixel's very code: half floats and a device's rounding move no code by more than 0.1 of a
    level.
    """
    check_views(views, grid)
    count = len(views)
    codes = light == "encoded"
    most = max(1, BAND_BYTES // (4 * count * grid.columns) - 2 * rule.halo)
    step = min(grid.rows, most)
    held = min(grid.rows, step + 2 * rule.halo)
    form = gl.RGBA8 if codes else gl.SRGB8_ALPHA8
    images = TextureArray(device, "view images", (grid.columns, held, count), form)
    images.parameters(gl.NEAREST, gl.NEAREST, ("clamp", "clamp"))
    weave = Weave(device, display, grid, count, rule, encoded=codes, pictures=not codes)
    for start in range(0, grid.rows, step):
        end = min(start + step, grid.rows)
        first = max(0, start - rule.halo)
        for layer, picture in enumerate(views):
            images.upload(layer, _with_alpha(picture[first : end + rule.halo]))
        weave(ViewImages(images, first, (start, end)))
    if codes:
        linear, pixels = None, weave.read_encoded()
    else:
        encode = Encode(device, *display.resolution_px, developed=True)
        encode(weave.panel, 0)
        linear, pixels = weave.read_linear(), encode.read()
        encode.release()
    device.check()
    for owner in (images, weave):
        owner.release()
    return pixels, linear


def check_views(views: NDArray[np.uint8], grid: ViewGrid) -> None:
    """Raise UsageError for an array that is not views of this grid."""
    wanted = (grid.rows, grid.columns, 3)
    if views.dtype != np.uint8 or views.ndim != 4 or views.shape[1:] != wanted or not len(views):
        raise UsageError(
            f"views are {views.dtype} {list(views.shape)}; they should be uint8 "
            f"[view, {grid.rows}, {grid.columns}, 3]"
        )


def _with_alpha(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    full = np.full((*picture.shape[:2], 4), 255, np.uint8)
    full[..., :3] = picture
    return full

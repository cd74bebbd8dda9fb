"""The standard that pictures are measured against (GStd in Gavane and Watson 2024): one view from
its own eye by MVR, many samples a pixel.

A pixel is the mean of its samples in linear light after tone mapping, as an eye that is too far
away to tell them apart would see them. Samples are themselves filtered by the level-of-detail rule
asked for: as their footprints are so many times smaller each way, that changes little.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import Camera, DisplayProfile, Rig
from lfd_render.errors import PictureError
from lfd_render.panel.picture import write_png
from lfd_render.quality import rmse, ssim_luma
from lfd_render.quality.metrics import SSIM_WINDOW
from lfd_render.reference.encode import srgb_from_linear
from lfd_render.reference.textures import linear_from_srgb
from lfd_render.renderer import Renderer
from lfd_render.scene import Scene

Pixels = NDArray[np.uint8]
Box = tuple[slice, slice]
LEAST_SEEN = 8  # of 255, in any channel: what is darker counts as the black around an object
_LINEAR_OF_CODE = linear_from_srgb(np.arange(256) / 255.0)


def chosen_views(views: int, compared: int) -> list[int]:
    """So many of the views, evenly spread, the extreme ones included."""
    found: list[int] = np.unique(np.linspace(0, views - 1, compared).round().astype(int)).tolist()
    return found


def alone(rig: Rig, view: int) -> Rig:
    """One view's eye and no other."""
    return dataclasses.replace(rig, eye_x_mm=rig.eye_x_mm[view : view + 1])


def gold_standard(
    renderer: Renderer,
    scene: Scene,
    display: DisplayProfile,
    camera: Camera | None,
    *,
    eye: Rig,
    view_size: tuple[int, int],
    samples: int = 8,
    lod: str = "anisotropic",
) -> Pixels:
    """The picture of a rig of one eye, uint8 [y, x, 3], samples × samples a pixel."""
    assert eye.views == 1
    width, height = view_size
    fine = renderer.views(
        scene,
        display,
        camera,
        rig=eye,
        view_size=(samples * width, samples * height),
        technique="mvr",
        lod=lod,
    )[0]
    strips = fine.reshape(height, samples, width, samples, 3)
    linear = np.stack([_LINEAR_OF_CODE[strip].mean(axis=(0, 2)) for strip in strips])
    return np.rint(255.0 * srgb_from_linear(linear)).astype(np.uint8)


def object_box(picture: Pixels) -> Box:
    """Rows and columns of what is not black, no smaller than SSIM's window where there is room.

    Raises PictureError for a black picture.
    """
    seen = picture.max(axis=-1) > LEAST_SEEN
    if not seen.any():
        raise PictureError("standard: all of it is black; choose a camera that sees the scene")
    rows, columns = (
        _grown(np.flatnonzero(seen.any(axis=axis)), seen.shape[1 - axis]) for axis in (1, 0)
    )
    return rows, columns


def _grown(seen: NDArray[np.int64], size: int) -> slice:
    first, end = int(seen[0]), int(seen[-1]) + 1
    missing = max(0, SSIM_WINDOW - (end - first))
    first = max(0, min(first - missing // 2, size - SSIM_WINDOW)) if missing else first
    return slice(first, max(end, min(size, first + SSIM_WINDOW)))


def likeness(picture: Pixels, standard: Pixels) -> tuple[float, float]:
    """RMSE in levels of 255 and SSIM over the box of the standard's object.

    Raises UsageError without scikit-image.
    """
    box = object_box(standard)
    cut, whole = np.ascontiguousarray(picture[box]), np.ascontiguousarray(standard[box])
    return rmse(cut, whole), ssim_luma(cut, whole)


def write_views(folder: Path, views: Sequence[int], pictures: dict[str, NDArray[np.uint8]]) -> None:
    """Write stacks of views [view, y, x, 3] as NAME_VIEW.png."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, stack in pictures.items():
        for view, pixels in zip(views, stack, strict=True):
            write_png(folder / f"{name}_{view:03d}.png", pixels)

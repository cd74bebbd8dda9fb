"""How the picture that a panel takes lies, against what the viewer sees.

All phases and pictures are as the viewer sees them; `Mount` is applied once, where a panel image is
written, and undone once, where one is read.
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from lfd_render.display.model import Mount

T = TypeVar("T", bound=np.generic)


def stored(seen: NDArray[T], mount: Mount | None) -> NDArray[T]:
    """Panel image [y, x, …] as the panel takes it, of one as the viewer sees it."""
    if mount is None:
        return seen
    flipped = seen[_steps(mount)]
    return np.ascontiguousarray(np.rot90(flipped, mount.rotation_deg // 90))


def seen(stored: NDArray[T], mount: Mount | None) -> NDArray[T]:
    """Panel image [y, x, …] as the viewer sees it, of one as the panel takes it."""
    if mount is None:
        return stored
    upright = np.rot90(stored, -(mount.rotation_deg // 90))
    return np.ascontiguousarray(upright[_steps(mount)])


def stored_size(size_px: tuple[int, int], mount: Mount | None) -> tuple[int, int]:
    """Width and height of the picture that the panel takes."""
    turned = mount is not None and mount.rotation_deg % 180 == 90
    return size_px[::-1] if turned else size_px


def _steps(mount: Mount) -> tuple[slice, slice]:
    forward, back = slice(None), slice(None, None, -1)
    return back if mount.flip_y else forward, back if mount.flip_x else forward

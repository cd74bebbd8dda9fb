"""Checks of the arrays that scenes are made of: shape, type and finite values, then read-only."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfd_render.errors import SceneError


def freeze(
    owner: Any, label: str, field: str, dtype: type[np.generic], shape: tuple[int | None, ...]
) -> None:
    """Check one array field of a frozen dataclass and put a read-only view in its place."""
    array = getattr(owner, field)
    wanted = "[" + ", ".join("n" if s is None else str(s) for s in shape) + f"] {dtype.__name__}"
    if not isinstance(array, np.ndarray):
        raise SceneError(f"{label}: {field}: {type(array).__name__}; give a numpy array {wanted}")
    fits = len(array.shape) == len(shape) and all(
        want in (None, got) for want, got in zip(shape, array.shape, strict=True)
    )
    if not fits or array.dtype != dtype:
        raise SceneError(f"{label}: {field}: {list(array.shape)} {array.dtype}; give {wanted}")
    # The extremes carry any NaN or infinity and, unlike isfinite, need no array of their own.
    extremes = (array.min(), array.max()) if array.size else ()
    if issubclass(dtype, np.floating) and not np.isfinite(extremes).all():
        row = int(np.argmin(np.isfinite(array.reshape(len(array), -1)).all(axis=1)))
        raise SceneError(f"{label}: {field}[{row}]: {array[row].tolist()}; give finite numbers")
    view = array.view()
    view.setflags(write=False)
    object.__setattr__(owner, field, view)


def check_affine(owner: Any, label: str, field: str) -> None:
    """Check a [4, 4] float64 matrix whose last row is 0 0 0 1, as `freeze` does."""
    freeze(owner, label, field, np.float64, (4, 4))
    matrix: NDArray[np.float64] = getattr(owner, field)
    if not np.array_equal(matrix[3], (0.0, 0.0, 0.0, 1.0)):
        raise SceneError(f"{label}: {field}: last row {matrix[3].tolist()}; give 0 0 0 1")

"""One frame's camera, as passes need it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Placement:
    """Where the window stands in a frame. display_from_world: float64 [4, 4]; background: linear
    RGB; exposure: of pictures that are encoded."""

    display_from_world: NDArray[np.float64]
    background: tuple[float, float, float]
    exposure: float = 1.0

    @cached_property
    def turn_from_display(self) -> NDArray[np.float64]:
        """How shaders turn directions to the world, float64 [4, 4]: the inverse over its largest
        entry, so that they may square what they turn, however large or small the world is."""
        turn = np.eye(4)
        forth = self.display_from_world[:3, :3]
        back = np.linalg.inv(forth / np.abs(forth).max())
        turn[:3, :3] = back / np.abs(back).max()
        return turn


def gl_matrix(matrix: NDArray[np.float64]) -> bytes:
    """A [4, 4] matrix of column vectors as a mat4 uniform: float32, column by column."""
    return matrix.T.astype(np.float32).tobytes()

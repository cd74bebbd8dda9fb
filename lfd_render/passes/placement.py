"""One frame's camera, as passes need it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

_LEAST_UNIT = 1e-18  # of the world in millimetres and the other way round: float32 squares it


@dataclass(frozen=True)
class Placement:
    """Where the window stands in a frame. display_from_world: float64 [4, 4]; background: linear
    RGB."""

    display_from_world: NDArray[np.float64]
    background: tuple[float, float, float]

    @cached_property
    def turn_from_display(self) -> NDArray[np.float64]:
        """How shaders turn directions to the world, float64 [4, 4]. The upper 3×3 is the inverse
        over its largest entry, so that they may square what they turn, however large or small the
        world is; the last entry is that factor, for the places of lights."""
        turn = np.eye(4)
        forth = self.display_from_world[:3, :3]
        largest = np.abs(forth).max()
        back = np.linalg.inv(forth / largest)
        most = np.abs(back).max()
        turn[:3, :3] = back / most
        turn[3, 3] = np.clip(most / largest, _LEAST_UNIT, 1.0 / _LEAST_UNIT)
        return turn


def gl_matrix(matrix: NDArray[np.float64]) -> bytes:
    """A [4, 4] matrix of column vectors as a mat4 uniform: float32, column by column."""
    return matrix.T.astype(np.float32).tobytes()

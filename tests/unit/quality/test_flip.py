"""FLIP: nothing for equal pictures, one for black and white, less when seen from afar."""

import numpy as np
import pytest

from lfd_render.errors import PictureError
from lfd_render.quality import flip


def test_flip_has_its_known_values() -> None:
    black, white = (np.full((32, 48, 3), level, np.uint8) for level in (0, 255))
    assert flip(black, black, 20.0) == 0.0
    assert flip(black, white, 20.0) == pytest.approx(1.0, abs=0.05)
    checker = np.indices((32, 48)).sum(axis=0)[..., None] % 2 * np.full(3, 255, np.uint8)
    grey = np.full((32, 48, 3), 188, np.uint8)
    assert flip(grey, checker.astype(np.uint8), 100.0) < flip(grey, checker.astype(np.uint8), 5.0)


def test_pictures_must_be_alike() -> None:
    with pytest.raises(PictureError, match="of one size"):
        flip(np.zeros((8, 8, 3), np.uint8), np.zeros((8, 9, 3), np.uint8), 20.0)

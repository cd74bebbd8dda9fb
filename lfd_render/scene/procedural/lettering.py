"""Digits and signs for test charts, drawn from a 5 × 7 dot matrix."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_ROWS = 7
_DOTS = {
    "0": "01110 10001 10011 10101 11001 10001 01110",
    "1": "00100 01100 00100 00100 00100 00100 01110",
    "2": "01110 10001 00001 00110 01000 10000 11111",
    "3": "11111 00010 00100 00010 00001 10001 01110",
    "4": "00010 00110 01010 10010 11111 00010 00010",
    "5": "11111 10000 11110 00001 00001 10001 01110",
    "6": "00110 01000 10000 11110 10001 10001 01110",
    "7": "11111 00001 00010 00100 01000 01000 01000",
    "8": "01110 10001 10001 01110 10001 10001 01110",
    "9": "01110 10001 10001 01111 00001 00010 01100",
    "+": "00000 00100 00100 11111 00100 00100 00000",
    "-": "00000 00000 00000 11111 00000 00000 00000",
    ".": "00000 00000 00000 00000 00000 01100 01100",
}


def lettering(text: str, dot: int) -> NDArray[np.bool_]:
    """The text as ink [y, x], each dot of the matrix `dot` pixels wide, one dot between signs."""
    signs = [
        np.array([[mark == "1" for mark in row] for row in _DOTS[sign].split()]) for sign in text
    ]
    gap = np.zeros((_ROWS, 1), bool)
    line = np.concatenate([part for sign in signs for part in (sign, gap)][:-1], axis=1)
    return np.kron(line, np.ones((dot, dot), bool))

"""What a sheet has over its lattice, smooth over the panel, from the phases that a fit leaves."""

from __future__ import annotations

import numpy as np

from lfd_render.display.calibration.corners import Float64
from lfd_render.display.model import PhaseCorrection
from lfd_render.display.profile import DisplayProfile

NODES = (9, 9)
_DEGREE = 4


def correction_of(
    residual: Float64, u: Float64, v: Float64, guess: DisplayProfile
) -> tuple[PhaseCorrection, float]:
    """A guess's correction and what its fit leaves, and the standard uncertainty of a node.

    residual: lenses by which the phase is further than the plane, [block], NaN where none was
    measured; u, v of the blocks, v from the bottom. A polynomial of the fourth degree, without the
    plane that is the lattice's own.
    """
    measured = np.isfinite(residual)
    design = _terms(u[measured], v[measured])
    found, *_ = np.linalg.lstsq(design, residual[measured], rcond=None)
    left = residual[measured] - design @ found
    variance = float(left @ left) / max(len(left) - design.shape[1], 1)
    rows, columns = NODES
    node_v, node_u = np.meshgrid(np.linspace(1, 0, rows), np.linspace(0, 1, columns), indexing="ij")
    terms = _terms(node_u.ravel(), node_v.ravel())
    # The plane is the lattice's: only what is beyond it counts.
    terms[:, :3] = 0
    smooth = (terms @ found).reshape(NODES)
    known = guess.phase_tables()
    if known.correction is not None:
        smooth = smooth + _at_nodes(known.correction)
    doubt = np.einsum("ni,ij,nj->n", terms, np.linalg.pinv(design.T @ design), terms) * variance
    stated = tuple(tuple(float(x) for x in row) for row in smooth)
    return PhaseCorrection(phase_lenses=stated), float(np.sqrt(doubt.mean()))


def _terms(u: Float64, v: Float64) -> Float64:
    """Products of Legendre polynomials up to the degree, those of a plane first, [place, term]."""
    x, y = 2 * u - 1, 2 * v - 1
    across = np.polynomial.legendre.legvander(x, _DEGREE)
    up = np.polynomial.legendre.legvander(y, _DEGREE)
    powers = [(i, k - i) for k in range(_DEGREE + 1) for i in range(k + 1)]
    return np.stack([across[:, i] * up[:, j] for i, j in powers], axis=1)


def _at_nodes(correction: Float64) -> Float64:
    """A correction of other nodes at ours, bilinear, [row, column]."""
    rows, columns = correction.shape
    at = np.linspace(0, columns - 1, NODES[1])
    wide = np.stack([np.interp(at, np.arange(columns), row) for row in correction])
    at = np.linspace(0, rows - 1, NODES[0])
    return np.stack([np.interp(at, np.arange(rows), column) for column in wide.T], axis=1)

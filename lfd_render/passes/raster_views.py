"""The views of a hardware raster: their matrices, planes and parts of a texture."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import Rig, ViewGrid
from lfd_render.gpu.layout import dtype
from lfd_render.passes.pipelines import Parts, Pipeline
from lfd_render.passes.view_target import Band, ViewTarget


def band_views(
    target: ViewTarget, band: Band, pipeline: Pipeline, parts: Parts
) -> NDArray[np.void]:
    """RasterView of each view's rows of a band, [view]."""
    rig, grid = target.rig, target.grid
    distance, margin_columns = rig.distance_mm, max(2, grid.fineness)
    half_width = 0.5 * rig.panel_mm[0] + margin_columns * grid.column_mm  # lenses begin outside
    records = np.zeros(rig.views, dtype("RasterView"))
    for view, record in enumerate(records):
        eye = float(rig.eye_x_mm[view])
        record["clip_from_display"] = band_clip_from_display(rig, grid, band, view).T.ravel()
        record["left"] = distance, 0.0, -eye - half_width, half_width * distance
        record["right"] = -distance, 0.0, eye - half_width, half_width * distance
        record["eye"] = eye, 0.0, distance, 1.0
    place_parts(records, pipeline, parts, band.rows)
    return records


def place_parts(records: NDArray[np.void], pipeline: Pipeline, parts: Parts, rows: int) -> None:
    """Write where views lie that share a texture; rows: of each that are drawn."""
    records["part"] = 1.0, 1.0, 0.0, 0.0
    size = np.array(parts.size[:2], np.float64)
    extent = np.array([parts.columns, rows], np.float64)
    for view, record in enumerate(records):
        low = np.array(parts.corner(view)[:2], np.float64)
        record["box"] = *low, *(low + extent)
        if pipeline.partitioned and pipeline.clipping != "viewport":
            record["part"] = *(extent / size), *((2.0 * low + extent) / size - 1.0)


def band_clip_from_display(rig: Rig, grid: ViewGrid, band: Band, view: int) -> NDArray[np.float64]:
    """clip_from_display, float64 [4, 4], of one view's band: column c of row r has its centre at
    the raster's (c + ½, r − band.first + ½), row 0 at the bottom.

    column·d = D·X/column_mm + (d − D)·eye + offset·d, with an offset linear in the row (`upright`
    or `sheared` grids), and row·d = (h/2·d − D·Y)/row_mm; d = D − Z; depth d − 2·near.
    """
    distance = rig.distance_mm
    height = rig.panel_mm[1]
    eye = rig.eye_x_mm[view] / grid.column_mm
    row_mm = height / grid.rows
    slope = float(grid.row_offset[1] - grid.row_offset[0]) if grid.rows > 1 else 0.0
    start = float(grid.row_offset[0]) - 0.5 * slope
    assert np.allclose(grid.row_offset, start + slope * (np.arange(grid.rows) + 0.5), atol=1e-6)

    depth = np.array([0.0, 0.0, -1.0, distance])
    row = 0.5 * height / row_mm * depth + np.array([0.0, -distance / row_mm, 0.0, 0.0])
    column = np.array([distance / grid.column_mm, 0.0, -eye, 0.0]) + start * depth + slope * row
    return np.stack(
        [
            2.0 / grid.columns * column - depth,
            2.0 / band.rows * (row - band.first * depth) - depth,
            depth + np.array([0.0, 0.0, 0.0, -2.0 * rig.near_mm]),
            depth,
        ]
    )

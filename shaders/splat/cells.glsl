// Splat one point of the paper's lattice into a view: the pixels of the box about its cell that lie inside
// the triangle (Gavane and Watson 2023, sections 3.3 and 3.5). Which pixels of a row do is told by
// the triangle's slice, with the arithmetic of rows of points, so that both lattices cover the same.
// In: Cells, CellWork, LatticeSteps, the batch, Eyes (columns), RowOffsets. Out: what visit() writes.

#include "common/triangles.glsl"
#include "cells/lattice.glsl"
#include "common/alpha.glsl"
#include "sample/point_row.glsl"
#include "common/slices.glsl"
#include "splat/interval.glsl"
#include "layout/CellWork"

layout(std430) readonly restrict buffer Cells { Cell cells[]; };
layout(std430) readonly restrict buffer CellWorkBlock { CellWork cell_work; };
layout(std430) readonly restrict buffer LatticeSteps { vec2 lattice_steps_mm[]; };
layout(std430) readonly restrict buffer Eyes { float eyes[]; };

uniform int first_row;  // the strip of the window to splat into, which bounds what is looped over
uniform int end_row;

void splat_cell(Cell point, int view, float eye) {
    uvec4 corners = corners_of(point.triangle);
    vec3 a = position_of(corners.x);
    vec3 b = position_of(corners.y);
    vec3 c = position_of(corners.z);
    Plane plane = triangle_plane(a, b, c);
    Aligned t = align(a, b, c, plane);
    Box box = cell_box(t, lattice_steps_mm[point.triangle], uvec2(point.cell & 0xFFFFu, point.cell >> 16), eye);
    ivec2 boxed_rows = rows_of_box(box), rows = clamp(boxed_rows, first_row, end_row);
    int boxed = 0;
    for (int row = rows.x; row < rows.y; row++) {
        PointRow points = point_row(point.triangle, row);
        Interval seen = interval_of(points, eye);
        int left = column_cut(box.columns.x + row_offsets[row]);
        int right = column_cut(box.columns.y + row_offsets[row]);
        boxed += max(right - left, 0);
        seen.column = max(seen.column, left);
        seen.end = min(seen.end, right);
        splat_interval(points, seen, view, eye);
    }
    if (faces(draw_facing(corners.w), eye_side(plane, eye * frame.column_mm)))
        tried(uint(boxed_rows.x >= first_row && boxed_rows.x < end_row ? max(boxed, 1) : boxed));
}

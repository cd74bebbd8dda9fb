// Splat points into all views by the shear identity. A work group takes one row of points, so that
// all its loads are uniform; a lane is a view. A point's footprint in a view, cut to the triangle (the
// inside-triangle test of Gavane and Watson 2023, section 3.3), is an interval of columns whose ends
// move linearly with the eye.
// In: PointRows, Work, Eyes (columns); the batch where alpha counts. Out: Depths or Words.

layout(local_size_x = VIEW_LANES) in;

#include "common/triangles.glsl"
#include "common/points.glsl"
#include "common/alpha.glsl"
#include "splat/visit.glsl"

layout(std430) readonly restrict buffer Eyes { float eyes[]; };  // in columns, view 0 first

// First column whose centre is not left of a position: centres on a left edge are inside.
int column_cut(float column) {
    return int(ceil(clamp(column, -1e6, 1e6) - 0.5));
}

void main() {
    uint place = gl_WorkGroupID.y * GROUPS_ACROSS + gl_WorkGroupID.x;
    int view = int(gl_WorkGroupID.z * VIEW_LANES + gl_LocalInvocationID.x);
    // llvmpipe loads once for all lanes only where no branch or return has come before.
    PointRow points = point_rows[place];
    uint facing = place < work[window].items && view < frame.views ? points.facing : FACING_NOWHERE;
    Plane plane = row_plane(points);
    Slice slice = row_slice(points);
    float eye = eyes[view], eye_mm = eye * frame.column_mm;
    int row = int(points.row);
    float y_mm = row_centre_mm(row);
    uint line = view_pixel(row, view, 0), id = frame.triangle_base + points.triangle;

    int column = column_cut(column_from(slice.a, eye)), last = column_cut(column_from(slice.b, eye));
    int low = max(min(column, last), 0), high = min(max(column, last), frame.columns);
    if (!faces(facing, eye_side(plane, eye_mm))) high = low;

    // From cell boundary to cell boundary. In its own (densest) view a boundary lies at a multiple of
    // the cell, and 1 − k is linear along the slice there; other views shear it.
    float from = column_from(slice.a, points.densest_eye), to = column_from(slice.b, points.densest_eye);
    float toward_per_column = (slice.b.toward - slice.a.toward) / (to - from);
    ivec2 cells = row_cells(points, slice);
    for (int cell = cells.x + 1; cell <= cells.y; cell++) {
        float boundary = float(cell) * points.cell;
        float toward = slice.a.toward + (boundary - from) * toward_per_column;
        int next = cell < cells.y ? column_cut(boundary + toward * (eye - points.densest_eye)) : last;
        int end = clamp(max(column, next), low, high);
        for (int c = clamp(min(column, next), low, high); c < end; c++) {
            float x_mm = (float(c) + 0.5 - points.row_offset) * frame.column_mm;
            if (ALPHA_TESTED != 0 && !alpha_accepts(points.triangle, plane, eye_mm, x_mm, y_mm))
                continue;
            visit(line + uint(c), plane_depth(plane, eye_mm, x_mm, y_mm), id);
        }
        column = next;
    }
}

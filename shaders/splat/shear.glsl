// Splat a row of points into a view by the shear identity: what its points cover there, cut to the
// triangle (the inside-triangle test of Gavane and Watson 2023, section 3.3), is an interval of columns
// whose ends move linearly with the eye.
// In: PointRows, Work, Eyes (columns); the batch where alpha counts. Out: what visit() writes.

#include "common/triangles.glsl"
#include "common/points.glsl"
#include "common/alpha.glsl"

layout(std430) readonly restrict buffer Eyes { float eyes[]; };  // in columns, view 0 first

const float ROUNDING_COLUMNS = 6e-5;  // two ulps of a column coordinate near 500

// First column whose centre is not left of a position: centres on a left edge are inside.
int column_cut(float column) {
    return int(ceil(clamp(column, -1e6, 1e6) - 0.5));
}

void splat_row(PointRow points, bool real, int view, float eye) {
    Slice slice = slice_of(points);
    float a = column_from(slice.a, eye), b = column_from(slice.b, eye);
    // Rounding may turn a slice of no length round; its neighbours rely on what it covers.
    bool seen = a < b + ROUNDING_COLUMNS || (points.row_sides & DOUBLE_SIDED) != 0u;

    int column = max(column_cut(min(a, b)), 0), end = min(column_cut(max(a, b)), frame.columns);
    if (!real || !seen || view >= frame.views) end = column;

    // k is linear along the slice as a view sees it; rounding must not leave the slice's own range.
    float k_per_column = (points.b_depth_k - points.a_depth_k) / (b - a);
    float k_nearest = max(points.a_depth_k, points.b_depth_k), k_farthest = min(points.a_depth_k, points.b_depth_k);
    int row = row_of(points);
    uint line = view_pixel(row, view, 0), id = frame.triangle_base + points.triangle;
    for (; column < end; column++) {
        if (ALPHA_TESTED != 0 && !alpha_accepts(points.triangle, eye, row, column)) continue;
        precise float k = points.a_depth_k + (float(column) + 0.5 - a) * k_per_column;
        visit(line + uint(column), frame.distance_mm / clamp(k, k_farthest, k_nearest), id);
    }
}

// The columns that a row of points covers in a view, and the visit of each.
// Needs: the batch, alpha, visit().

#include "common/vertex_culling.glsl"

const float ROUNDING_COLUMNS = 6e-5;  // two ulps of a column coordinate near 500

// First column of the view, or its end, whose centre is not left of a position: centres on a left edge are inside.
int column_cut(float column) {
    return int(ceil(clamp(column - 0.5, 0.0, float(frame.columns))));
}

struct Interval {
    int column, end;
    float a, b;  // where the slice's ends appear, in columns
    bool faced;
};

Interval interval_of(PointRow points, float eye) {
    Slice slice = slice_of(points);
    float a = column_from(slice.a, eye), b = column_from(slice.b, eye);
    // Rounding may turn a slice of no length round; its neighbours rely on what it covers.
    bool faced = a < b + ROUNDING_COLUMNS || (points.row_sides & DOUBLE_SIDED) != 0u, seen = faced;
    if (VERTEX_CULLING != 0) {
        uvec4 corners = corners_of(points.triangle);
        seen = seen && vertices_seen(position_of(corners.x), position_of(corners.y), position_of(corners.z), eye);
    }
    int column = column_cut(min(a, b)), end = column_cut(max(a, b));
    return Interval(column, seen ? end : column, a, b, faced);
}

void splat_interval(PointRow points, Interval seen, int view, float eye) {
    // k is linear along the slice as a view sees it; rounding must not leave the slice's own range.
    float k_per_column = (points.b_depth_k - points.a_depth_k) / (seen.b - seen.a);
    float k_nearest = max(points.a_depth_k, points.b_depth_k), k_farthest = min(points.a_depth_k, points.b_depth_k);
    int row = row_of(points);
    uint line = view_pixel(row, view, 0), id = frame.triangle_base + points.triangle;
    int column = seen.column;
    do {
        bool covered = column < seen.end;
        if (ALPHA_TESTED != 0) covered = covered && alpha_accepts(points.triangle, eye, row, column);
        precise float k = points.a_depth_k + (float(column) + 0.5 - seen.a) * k_per_column;
        if (covered) visit(line + uint(column), frame.distance_mm / clamp(k, k_farthest, k_nearest), id);
    } while (++column < seen.end);
}

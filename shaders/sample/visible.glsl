// Exact culling: which rows of the band a triangle can be seen on. It survives when some view it faces has
// a row centre, and possibly a column centre, inside it.
// Needs: the batch.

#include "common/triangles.glsl"
#include "common/shear.glsl"
#include "common/plane.glsl"

const float ROUNDING_ROWS = 0.01;  // float32 error of a row coordinate, far above it

void extend(inout vec2 range, float value) {
    range = vec2(min(range.x, value), max(range.y, value));
}

// Rows that an edge's part in front of the near plane spans.
void extend_by_edge(inout vec2 range, vec3 p, vec3 q) {
    float over_p = depth_of(p) - frame.near_mm, over_q = depth_of(q) - frame.near_mm;
    if (over_p >= 0.0) extend(range, row_from(p));
    if ((over_p >= 0.0) != (over_q >= 0.0)) {
        vec3 cut = mix(p, q, over_p / (over_p - over_q));
        extend(range, (0.5 * frame.panel_height_mm - cut.y * frame.distance_mm / frame.near_mm) / frame.row_mm);
    }
}

// Row indices reach as far as an int holds; far outside the window they only need the right side.
int row_index(float row) {
    return int(clamp(row, -4.0, float(frame.rows) + 4.0));
}

bool crosses(vec3 a, vec3 b, vec3 c, int row) {
    float y = row_centre_mm(row);
    bvec3 up = bvec3(above_row(a, y) >= 0.0, above_row(b, y) >= 0.0, above_row(c, y) >= 0.0);
    return !(all(up) || !any(up));
}

// Columns at which a vertex appears over all eyes.
void extend_columns(inout vec2 range, vec3 p) {
    SliceEnd end = slice_end(p, 0.0);
    extend(range, column_from(end, frame.eye_first));
    extend(range, column_from(end, frame.eye_last));
}

// First row and number of rows; none when culled.
ivec2 rows_seen(vec3 a, vec3 b, vec3 c, Plane plane, uint facing) {
    // Facing: the side is linear in the eye, so the extreme eyes decide.
    float side_first = eye_side(plane, frame.eye_first * frame.column_mm);
    float side_last = eye_side(plane, frame.eye_last * frame.column_mm);
    if (!faces(facing, side_first) && !faces(facing, side_last)) return ivec2(0);

    vec2 rows = vec2(1e30, -1e30);
    extend_by_edge(rows, a, b);
    extend_by_edge(rows, b, c);
    extend_by_edge(rows, c, a);
    if (rows.x > rows.y) return ivec2(0);

    // Views that share their rows need those whose centre is inside; others all that are touched.
    int first = max(frame.band_first, row_index(WHOLE_ROWS == 0 ? ceil(rows.x - 0.5 - ROUNDING_ROWS) : floor(rows.x - ROUNDING_ROWS)));
    int last = min(frame.band_first + frame.band_rows - 1, row_index(WHOLE_ROWS == 0 ? floor(rows.y - 0.5 + ROUNDING_ROWS) : floor(rows.y + ROUNDING_ROWS)));
    if (WHOLE_ROWS == 0) {
        while (first <= last && !crosses(a, b, c, first)) first++;
        while (first <= last && !crosses(a, b, c, last)) last--;
    }
    if (first > last) return ivec2(0);

    // Columns: outside the window in every view. Only where nothing is cut by the near plane.
    if (max(a.z, max(b.z, c.z)) <= frame.distance_mm - frame.near_mm) {
        vec2 columns = vec2(1e30, -1e30);
        extend_columns(columns, a);
        extend_columns(columns, b);
        extend_columns(columns, c);
        float half_width = 0.5 * frame.panel_width_mm / frame.column_mm + margin_columns();
        if (columns.x > half_width || columns.y < -half_width) return ivec2(0);
    }
    return ivec2(first, last - first + 1);
}

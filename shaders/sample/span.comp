// Exact culling and point density, one thread a triangle (design: Gavane and Watson 2024, section
// 3.1, with rows shared by all views). A triangle survives when some view it faces has a row centre,
// and possibly a column centre, inside it.
// In: Triangles, DisplayPositions, Draws, Vertices, materials. Out: Spans.

layout(local_size_x = 128) in;

#include "common/triangles.glsl"
#include "common/shear.glsl"
#include "common/plane.glsl"
#include "sample/density.glsl"
#include "layout/Span"

layout(std430) writeonly restrict buffer Spans { Span spans[]; };

const float ROUNDING_ROWS = 0.01;  // float32 error of a row coordinate, far above it

// Row coordinate (top of the window 0, row centres at halves) of a point.
float row_from(vec3 p) {
    return (0.5 * frame.panel_height_mm - p.y * frame.distance_mm / depth_of(p)) / frame.row_mm;
}

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

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= frame.triangles) return;
    spans[index] = Span(0u, 1.0);

    uvec4 triangle = triangles[index];
    vec3 a = display_positions[triangle.x].xyz;
    vec3 b = display_positions[triangle.y].xyz;
    vec3 c = display_positions[triangle.z].xyz;

    // Facing: the side is linear in the eye, so the extreme eyes decide.
    Plane plane = triangle_plane(a, b, c);
    float side_first = eye_side(plane, frame.eye_first * frame.column_mm);
    float side_last = eye_side(plane, frame.eye_last * frame.column_mm);
    uint facing = draws[triangle.w].facing;
    if (!faces(facing, side_first) && !faces(facing, side_last)) return;

    vec2 rows = vec2(1e30, -1e30);
    extend_by_edge(rows, a, b);
    extend_by_edge(rows, b, c);
    extend_by_edge(rows, c, a);
    if (rows.x > rows.y) return;

    // Views that share their rows need those whose centre is inside; others all that are touched.
    int first = max(frame.band_first, row_index(WHOLE_ROWS == 0 ? ceil(rows.x - 0.5 - ROUNDING_ROWS) : floor(rows.x - ROUNDING_ROWS)));
    int last = min(frame.band_first + frame.band_rows - 1, row_index(WHOLE_ROWS == 0 ? floor(rows.y - 0.5 + ROUNDING_ROWS) : floor(rows.y + ROUNDING_ROWS)));
    if (WHOLE_ROWS == 0) {
        while (first <= last && !crosses(a, b, c, first)) first++;
        while (first <= last && !crosses(a, b, c, last)) last--;
    }
    if (first > last) return;

    // Columns: outside the window in every view. Only where nothing is cut by the near plane.
    if (max(a.z, max(b.z, c.z)) <= frame.distance_mm - frame.near_mm) {
        vec2 columns = vec2(1e30, -1e30);
        extend_columns(columns, a);
        extend_columns(columns, b);
        extend_columns(columns, c);
        float half_width = 0.5 * frame.panel_width_mm / frame.column_mm + 2.0;
        if (columns.x > half_width || columns.y < -half_width) return;
    }

    float side = max(abs(side_first), abs(side_last));
    if (STOCHASTIC_CULLING != 0 && !stochastically_kept(frame.triangle_base + index, plane, side)) return;
    spans[index] = Span(uint(first) | uint(last - first + 1) << 16, point_columns(triangle, plane, side));
}

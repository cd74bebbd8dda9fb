// The paper's lattice: a triangle's own plane, with one axis level and one square to it, in steps of the
// densest view's pixel sides (Gavane and Watson 2024, section 3.1, figure 5; T_align of Gavane and Watson
// 2022, equation 1). A point is a cell of the lattice that touches the triangle.
// Needs: the batch.

#include "common/triangles.glsl"
#include "common/shear.glsl"
#include "common/plane.glsl"
#include "layout/Cell"

const float ROUNDING_CELLS = 1e-3;  // far above the float32 error of a cell coordinate

// A triangle in its lattice. Coordinates are in mm along u and v from the triangle's low corner.
struct Aligned {
    vec3 a;          // a corner, in display space
    vec3 u, v;       // unit axes in the plane; u is level
    vec2 low;        // where coordinates start, from a
    vec2 corners[3];
};

vec2 extent_mm(Aligned t) {
    return max(t.corners[0], max(t.corners[1], t.corners[2]));
}

// Indices of the last cells along u and v.
ivec2 last_cell(Aligned t, vec2 step_mm) {
    return ivec2(floor(extent_mm(t) / step_mm + ROUNDING_CELLS));
}

Aligned align(vec3 a, vec3 b, vec3 c, Plane plane) {
    Aligned t;
    t.a = a;
    // Precise, so that all stages find the same cells.
    precise vec3 n = plane.normal / max(length(plane.normal), 1e-30);
    precise float across = sqrt(n.x * n.x + n.z * n.z);
    precise vec3 level = vec3(n.z, 0.0, -n.x) / across;  // up × n
    precise vec3 u = across > 1e-6 ? level : vec3(1.0, 0.0, 0.0);
    precise vec3 v = vec3(n.y * u.z - n.z * u.y, n.z * u.x - n.x * u.z, n.x * u.y - n.y * u.x);
    t.u = u;
    t.v = v;
    precise vec3 ab = b - a, ac = c - a;
    precise vec2 b_uv = vec2(ab.x * u.x + ab.y * u.y + ab.z * u.z, ab.x * v.x + ab.y * v.y + ab.z * v.z);
    precise vec2 c_uv = vec2(ac.x * u.x + ac.y * u.y + ac.z * u.z, ac.x * v.x + ac.y * v.y + ac.z * v.z);
    t.low = min(vec2(0.0), min(b_uv, c_uv));
    t.corners[0] = -t.low;
    t.corners[1] = b_uv - t.low;
    t.corners[2] = c_uv - t.low;
    return t;
}

vec3 display_from_lattice(Aligned t, vec2 mm) {
    vec2 from_a = mm + t.low;
    return t.a + from_a.x * t.u + from_a.y * t.v;
}

// First and last cell of lattice row j that the triangle touches, empty when the first is greater.
ivec2 cells_touched(Aligned t, vec2 step_mm, int j) {
    float low = float(j) - ROUNDING_CELLS, high = float(j) + 1.0 + ROUNDING_CELLS;
    vec2 range = vec2(1e30, -1e30);
    for (int i = 0; i < 3; i++) {
        precise vec2 p = t.corners[i] / step_mm, q = t.corners[i == 2 ? 0 : i + 1] / step_mm;
        if (p.y >= low && p.y <= high) range = vec2(min(range.x, p.x), max(range.y, p.x));
        for (int side = 0; side < 2; side++) {
            float at = side == 0 ? low : high;
            if ((p.y < at) == (q.y < at)) continue;
            precise float x = p.x + (at - p.y) / (q.y - p.y) * (q.x - p.x);
            range = vec2(min(range.x, x), max(range.y, x));
        }
    }
    if (range.x > range.y) return ivec2(0, -1);
    return clamp(ivec2(floor(range + vec2(-ROUNDING_CELLS, ROUNDING_CELLS))), 0, last_cell(t, step_mm).x);
}

// Where views see a cell: columns less the rows' offsets, and rows. Empty when low exceeds high.
struct Box {
    vec2 columns;
    vec2 rows;
};

void extend_box(inout Box box, vec3 p, float eye) {
    float column = column_from(slice_end(p, 0.0), eye), row = row_from(p);
    box.columns = vec2(min(box.columns.x, column), max(box.columns.y, column));
    box.rows = vec2(min(box.rows.x, row), max(box.rows.y, row));
}

// The box about what an eye, in columns, sees of a cell, cut at the near plane, with some margin for
// rounding: pixels are tested against the triangle, so a box may be too large but not too small.
Box cell_box(Aligned t, vec2 step_mm, uvec2 cell, float eye) {
    vec2 margin = ROUNDING_CELLS * step_mm + 1e-6 * (abs(t.low) + length(t.a));
    vec2 low = vec2(cell) * step_mm - margin, high = vec2(cell + 1u) * step_mm + margin;
    Box box = Box(vec2(1e30, -1e30), vec2(1e30, -1e30));
    for (int i = 0; i < 4; i++) {
        vec3 p = display_from_lattice(t, vec2(i == 1 || i == 2 ? high.x : low.x, i < 2 ? low.y : high.y));
        vec3 q = display_from_lattice(t, vec2(i < 2 ? high.x : low.x, i == 1 || i == 2 ? high.y : low.y));
        float over_p = depth_of(p) - frame.near_mm, over_q = depth_of(q) - frame.near_mm;
        if (over_p >= 0.0) extend_box(box, p, eye);
        if ((over_p >= 0.0) != (over_q >= 0.0)) {
            vec3 cut = mix(p, q, over_p / (over_p - over_q));
            cut.z = frame.distance_mm - frame.near_mm;
            extend_box(box, cut, eye);
        }
    }
    box.columns += (1e-2 + 1e-6 * abs(box.columns)) * vec2(-1.0, 1.0);
    box.rows += (1e-2 + 1e-6 * abs(box.rows)) * vec2(-1.0, 1.0);
    return box;
}

// First row of the band whose centre lies in a box, and the one after the last.
ivec2 rows_of_box(Box box) {
    return clamp(ivec2(ceil(clamp(box.rows - 0.5, -1e6, 1e6))), frame.band_first, frame.band_first + frame.band_rows);
}

// Rows on which some view may see a cell: rows are the same in all, columns move linearly with the eye.
int rows_ever_seen(Aligned t, vec2 step_mm, uvec2 cell) {
    Box first = cell_box(t, step_mm, cell, frame.eye_first), last = cell_box(t, step_mm, cell, frame.eye_last);
    ivec2 rows = rows_of_box(first);
    float half_width = 0.5 * frame.panel_width_mm / frame.column_mm + margin_columns();
    bool across = max(first.columns.y, last.columns.y) >= -half_width
        && min(first.columns.x, last.columns.x) <= half_width;
    return across ? max(rows.y - rows.x, 0) : 0;
}

// The shear identity (docs: geometry). For a display-space point (X, Y, Z) with d = D − Z and
// k = D/d, an eye at (s, 0, D) sees it at window x = k·X + (1 − k)·s and window y = k·Y. So the plane
// of a window row, which holds all eyes, cuts a triangle in a segment whose ends move linearly in s.

#include "common/frame.glsl"

// Where one end of such a segment appears: column = at_centre + (1 − k)·eye, eyes in columns.
struct SliceEnd {
    float at_centre;
    float k;
};

struct Slice {
    SliceEnd a;
    SliceEnd b;
    bool exists;
};

float column_from(SliceEnd end, float eye) {
    precise float column = end.at_centre + (1.0 - end.k) * eye;
    return column;
}

float depth_of(vec3 p_display) {
    return frame.distance_mm - p_display.z;
}

// Row coordinate (top of the window 0, row centres at halves) of a point.
float row_from(vec3 p) {
    return (0.5 * frame.panel_height_mm - p.y * frame.distance_mm / depth_of(p)) / frame.row_mm;
}

// ≥ 0 for points that appear on the row's centre line or above it; linear in the point, so that its
// zero on an edge is where the edge crosses the row, also behind the eyes.
float above_row(vec3 p_display, float row_y) {
    precise float value = p_display.y * frame.distance_mm - row_y * depth_of(p_display);
    return value;
}

// The point of an edge on a row. It is always computed from the upper vertex, which makes the two
// triangles of an edge agree to the bit.
vec3 crossing(vec3 p, vec3 q, float above_p, float above_q) {
    bool swap = above_p < 0.0;
    vec3 upper = swap ? q : p, lower = swap ? p : q;
    float above_upper = swap ? above_q : above_p, above_lower = swap ? above_p : above_q;
    precise float t = above_upper / (above_upper - above_lower);
    precise vec3 at_row = upper + t * (lower - upper);
    return at_row;
}

SliceEnd slice_end(vec3 p_display, float row_offset) {
    precise float k = frame.distance_mm / depth_of(p_display);
    precise float at_centre = k * p_display.x / frame.column_mm + row_offset;
    return SliceEnd(at_centre, k);
}

// Part of the segment p…q (parameters 0…1) where a linear function with these end values is ≥ 0.
vec2 positive_part(float at_p, float at_q) {
    if (at_p < 0.0 && at_q < 0.0) return vec2(2.0, -1.0);
    float root = at_p / (at_p - at_q);
    return vec2(at_p < 0.0 ? root : 0.0, at_q < 0.0 ? root : 1.0);
}

// Part of the segment that at least one of two eyes has on the inner side of its frustum's plane.
vec2 seen_by_either(vec2 at_p, vec2 at_q) {
    vec2 first = positive_part(at_p.x, at_q.x);
    vec2 last = positive_part(at_p.y, at_q.y);
    if (first.x > 1.0) return last;
    if (last.x > 1.0) return first;
    return vec2(min(first.x, last.x), max(first.y, last.y));
}

// Cut a segment to the near plane and to the union of the eyes' frusta, some columns of margin
// outside, so that the cut itself is never inside a view.
vec2 clip_slice(vec3 p, vec3 q) {
    vec2 ends = positive_part(depth_of(p) - frame.near_mm, depth_of(q) - frame.near_mm);
    float half_width = 0.5 * frame.panel_width_mm + margin_columns() * frame.column_mm;
    vec2 eyes = vec2(frame.eye_first, frame.eye_last) * frame.column_mm;
    // x_window·d = D·X + (d − D)·s, so the frustum's planes are linear in the point.
    precise vec2 x_p = frame.distance_mm * p.x - p.z * eyes;
    precise vec2 x_q = frame.distance_mm * q.x - q.z * eyes;
    float d_p = depth_of(p), d_q = depth_of(q);
    precise vec2 left_p = half_width * d_p + x_p, left_q = half_width * d_q + x_q;
    precise vec2 right_p = half_width * d_p - x_p, right_q = half_width * d_q - x_q;
    vec2 left = seen_by_either(left_p, left_q), right = seen_by_either(right_p, right_q);
    return vec2(max(ends.x, max(left.x, right.x)), min(ends.y, min(left.y, right.y)));
}

// The segment in which a row's plane cuts a triangle; it exists when vertices lie on both sides.
Slice slice_triangle(vec3 a, vec3 b, vec3 c, int row, float row_offset) {
    float row_y = row_centre_mm(row);
    float above_a = above_row(a, row_y), above_b = above_row(b, row_y), above_c = above_row(c, row_y);
    bvec3 up = greaterThanEqual(vec3(above_a, above_b, above_c), vec3(0.0));
    Slice slice;
    slice.exists = !(all(up) || !any(up));
    if (!slice.exists) return slice;

    // The two edges that cross: those of the vertex alone on its side.
    vec3 p, q;
    if (up.y == up.z) {
        p = crossing(a, b, above_a, above_b);
        q = crossing(a, c, above_a, above_c);
    } else if (up.x == up.z) {
        p = crossing(b, c, above_b, above_c);
        q = crossing(b, a, above_b, above_a);
    } else {
        p = crossing(c, a, above_c, above_a);
        q = crossing(c, b, above_c, above_b);
    }

    vec2 part = clip_slice(p, q);
    slice.exists = part.x < part.y;
    vec3 along = q - p;
    precise vec3 cut_a = p + part.x * along, cut_b = p + part.y * along;
    slice.a = slice_end(part.x > 0.0 ? cut_a : p, row_offset);
    slice.b = slice_end(part.y < 1.0 ? cut_b : q, row_offset);
    return slice;
}

// The paper's visibility, which tests vertices (Gavane and Watson 2023, section 3.1): a view is thought to
// see a triangle when a vertex lies in its frustum, made a fifth larger. It loses triangles that
// cover a view with all vertices outside, so it is an option (VERTEX_CULLING).

#include "common/shear.glsl"

const float ENLARGED = 1.2;

bool within_rows(vec3 p) {
    return depth_of(p) >= frame.near_mm
        && abs(p.y) * frame.distance_mm <= 0.5 * ENLARGED * frame.panel_height_mm * depth_of(p);
}

// eye: in columns.
bool vertex_seen(vec3 p, float eye) {
    float half_width = 0.5 * ENLARGED * frame.panel_width_mm / frame.column_mm;
    return within_rows(p) && abs(column_from(slice_end(p, 0.0), eye)) <= half_width;
}

// Whether any eye between the extremes has the vertex in its frustum.
bool vertex_ever_seen(vec3 p) {
    float half_width = 0.5 * ENLARGED * frame.panel_width_mm / frame.column_mm;
    SliceEnd end = slice_end(p, 0.0);
    float first = column_from(end, frame.eye_first), last = column_from(end, frame.eye_last);
    return within_rows(p) && max(first, last) >= -half_width && min(first, last) <= half_width;
}

bool vertices_ever_seen(vec3 a, vec3 b, vec3 c) {
    return vertex_ever_seen(a) || vertex_ever_seen(b) || vertex_ever_seen(c);
}

bool vertices_seen(vec3 a, vec3 b, vec3 c, float eye) {
    return vertex_seen(a, eye) || vertex_seen(b, eye) || vertex_seen(c, eye);
}

// Where a view pixel's ray meets a triangle: the hit, barycentric weights and how both change from
// pixel to pixel.

#include "common/plane.glsl"

struct Hit {
    vec3 p_display;
    vec3 weights;     // of vertices a, b, c
    vec3 weights_dx;  // change over one column
    vec3 weights_dy;  // change over one row, downward
    vec3 dp_dx;       // change of p_display, mm
    vec3 dp_dy;
};

// The ray hits the triangle's plane at depth d, t = d/D of the way to the window; its differential
// is t·(e − dir·(n·e)/(n·dir)) for a window step e.
Hit hit_triangle(vec3 a, vec3 b, vec3 c, Plane plane, float eye_mm, float x_mm, float y_mm) {
    vec3 direction = vec3(x_mm - eye_mm, y_mm, -frame.distance_mm);
    float t = 1.0 / plane_k(plane, eye_mm, x_mm, y_mm);
    Hit hit;
    hit.p_display = vec3(eye_mm, 0.0, frame.distance_mm) + t * direction;
    float across = dot(plane.normal, direction);
    vec3 slope = across == 0.0 ? vec3(0.0) : direction / across;
    hit.dp_dx = t * frame.column_mm * (vec3(1.0, 0.0, 0.0) - slope * plane.normal.x);
    hit.dp_dy = -t * frame.row_mm * (vec3(0.0, 1.0, 0.0) - slope * plane.normal.y);

    // Weight of b is linear in the point: dot(gradient, p − a), and so for c.
    vec3 scaled = plane.normal / dot(plane.normal, plane.normal);
    vec3 gradient_b = cross(c - a, scaled), gradient_c = cross(scaled, b - a);
    vec3 from_a = hit.p_display - a;
    vec2 bc = clamp(vec2(dot(gradient_b, from_a), dot(gradient_c, from_a)), 0.0, 1.0);
    hit.weights = vec3(max(0.0, 1.0 - bc.x - bc.y), bc);
    vec2 bc_dx = vec2(dot(gradient_b, hit.dp_dx), dot(gradient_c, hit.dp_dx));
    vec2 bc_dy = vec2(dot(gradient_b, hit.dp_dy), dot(gradient_c, hit.dp_dy));
    hit.weights_dx = vec3(-bc_dx.x - bc_dx.y, bc_dx);
    hit.weights_dy = vec3(-bc_dy.x - bc_dy.y, bc_dy);
    return hit;
}

// A triangle's plane, the side an eye stands on, and depth along a ray.

#include "common/frame.glsl"

struct Plane {
    vec3 normal;      // (B − A) × (C − A), mm²
    float at_centre;  // normal·(eye − A) for the eye at s = 0
    vec2 depths;      // nearest and farthest depth of the triangle's part in front of the near plane
};

Plane triangle_plane(vec3 a, vec3 b, vec3 c) {
    precise vec3 ab = b - a, ac = c - a;
    precise vec3 normal = vec3(ab.y * ac.z - ab.z * ac.y, ab.z * ac.x - ab.x * ac.z,
                               ab.x * ac.y - ab.y * ac.x);
    precise float at_centre = normal.z * (frame.distance_mm - a.z) - normal.x * a.x - normal.y * a.y;
    vec3 depths = vec3(frame.distance_mm) - vec3(a.z, b.z, c.z);
    float nearest = max(frame.near_mm, min(depths.x, min(depths.y, depths.z)));
    float farthest = max(depths.x, max(depths.y, depths.z));
    return Plane(normal, at_centre, vec2(nearest, farthest));
}

// normal·(eye − A): its sign is the side the eye stands on, its magnitude the sampling density.
float eye_side(Plane plane, float eye_mm) {
    precise float side = plane.at_centre + plane.normal.x * eye_mm;
    return side;
}

// The eye, in columns, that sees the plane densest: one of the extremes, since the density of a view
// grows with |side|, which is linear in the eye.
float densest_eye_columns(Plane plane) {
    float first = eye_side(plane, frame.eye_first * frame.column_mm);
    float last = eye_side(plane, frame.eye_last * frame.column_mm);
    return abs(first) > abs(last) ? frame.eye_first : frame.eye_last;
}

// k = D/d where the ray from the eye through a window point meets the plane, kept within the
// triangle's own depths, which bounds what rounding does to slivers. Linear in the window point.
float plane_k(Plane plane, float eye_mm, float x_mm, float y_mm) {
    precise float toward = plane.normal.x * (eye_mm - x_mm) - plane.normal.y * y_mm
        + plane.normal.z * frame.distance_mm;
    float side = eye_side(plane, eye_mm);
    float k_nearest = frame.distance_mm / plane.depths.x, k_farthest = frame.distance_mm / plane.depths.y;
    precise float k = toward / side;
    return side == 0.0 ? k_nearest : clamp(k, k_farthest, k_nearest);
}

// How the footprint of a surface point varies over the views, for equations 4, 5, 8 and 9 of Gavane and
// Watson 2024, evaluated at the point. Parallel views see a point at one depth, so the area that a pixel
// covers there is as 1/|side|, side = normal·(eye − A), which is linear in the eye.
// Needs: Eyes (columns, ascending).

#include "common/triangles.glsl"
#include "common/plane.glsl"
#include "shade/point.glsl"

// Least of sign·side over the views where it is above 0: an extreme eye's, or, if the side changes sign
// between the extremes, that of the last eye before. Infinite if there is none.
float least_side(Plane plane, float sign) {
    int rising = sign * plane.normal.x > 0.0 ? 1 : -1;  // towards which end the side grows
    int below = -1, above = frame.views;  // views from the low end on: at most 0, above 0
    float at_low = sign * eye_side(plane, (rising > 0 ? frame.eye_first : frame.eye_last) * frame.column_mm);
    float at_high = sign * eye_side(plane, (rising > 0 ? frame.eye_last : frame.eye_first) * frame.column_mm);
    if (at_low > 0.0) return at_low;
    if (at_high <= 0.0) return 1e30;
    float least = at_high;
    while (above - below > 1) {
        int middle = (below + above) / 2;
        float side = sign * eye_side(plane, eyes[rising > 0 ? middle : frame.views - 1 - middle] * frame.column_mm);
        if (side > 0.0) {
            above = middle;
            least = side;
        } else {
            below = middle;
        }
    }
    return least;
}

// As Footprint.views.
vec3 footprint_views(uint triangle, Plane plane, float eye_mm, uint facing, float depth) {
    float first = eye_side(plane, frame.eye_first * frame.column_mm);
    float last = eye_side(plane, frame.eye_last * frame.column_mm);
    float side = eye_side(plane, eye_mm), sign = side < 0.0 ? -1.0 : 1.0;
    bool both = (facing & FACING_BOTH) != 0u;
    float least = least_side(plane, sign), most = max(sign * first, sign * last);
    if (both) {
        least = min(least, least_side(plane, -sign));
        most = max(abs(first), abs(last));
    }
    // Rounding must not leave this very view outside.
    float own = abs(side), smallest = own / max(most, max(own, 1e-30));
    float largest = clamp(own / max(min(least, own), 1e-30), 1.0, 1e12);

    // Equation 8: a splat no smaller than this view's pixel, of so many densest pixels.
    float densest = max(abs(first), abs(last));
    float splat = own / max(densest, 1e-30) * densest_pixels_of(triangle, plane, depth);
    float used = clamp(max(1.0, splat), smallest, largest);
    return vec3(smallest, largest, largest > smallest ? (used - smallest) / (largest - smallest) : 0.0);
}

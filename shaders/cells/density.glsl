// Steps of the paper's lattice: at the point of the triangle closest to each eye a view pixel's sides are
// projected back, and the shortest over the views are S_ortho; equations 1–3 lengthen them where textures
// are coarser (Gavane and Watson 2024, section 3.1).
// Needs: the batch, Eyes (columns).

#include "cells/lattice.glsl"
#include "common/closest.glsl"
#include "sample/density.glsl"

// Lattices have at most MOST_CELLS a side, as rasters have; points of huge triangles are larger instead.
vec2 lattice_step_mm(uvec4 triangle, vec3 a, vec3 b, vec3 c, Plane plane, Aligned t) {
    vec2 step_mm = vec2(1e30);
    for (int view = 0; view < frame.views; view++) {
        float eye_mm = eyes[view] * frame.column_mm;
        if (eye_side(plane, eye_mm) == 0.0) continue;  // the eye sees the plane edge-on
        vec3 closest = closest_on_triangle(vec3(eye_mm, 0.0, frame.distance_mm), a, b, c);
        step_mm = min(step_mm, pixel_sides_mm(plane, closest, eye_mm));
    }
    if (ISOTROPIC != 0) step_mm = vec2(min(step_mm.x, step_mm.y));
    float size_uv = TEXTURE_LIMIT == 0 ? 0.0 : texel_mm2(triangle, plane), size_xy = step_mm.x * step_mm.y;
    if (size_uv > size_xy) step_mm *= sqrt(size_uv / size_xy);  // equation 3
    // No larger than the triangle either, whose coordinates may make a texel larger.
    return max(min(step_mm, 1.01 * extent_mm(t)), max(extent_mm(t) / float(MOST_CELLS - 2), 1e-12));
}

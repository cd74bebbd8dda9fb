// How long a point may be along its row: the texture-based limit, equations 1–3 of Gavane and
// Watson 2024. Rows stay dense, since they are shared by all views.

#include "common/material.glsl"
#include "common/vertices.glsl"
#include "common/hash.glsl"

const float MOST_COLUMNS = 16.0;  // bound on a point's length where no texture limits it

float area(vec2 a, vec2 b, vec2 c) {
    vec2 ab = b - a, ac = c - a;
    return 0.5 * abs(ab.x * ac.y - ab.y * ac.x);
}

// Area of the densest view pixel on the triangle: a plane sees it at its nearest depth d from the eye
// of the greater side, where it is column·row·d³ / (D²·side/|normal|).
float densest_pixel_mm2(Plane plane, float side) {
    float d = plane.depths.x;
    return frame.column_mm * frame.row_mm * d * d * d * length(plane.normal)
        / (frame.distance_mm * frame.distance_mm * side);
}

// Whether stochastic culling keeps a triangle: of those under a tenth of a pixel, with probability
// 10·area (Gavane and Watson 2023, section 3.2). It punches holes in fine meshes, so it is an option.
bool stochastically_kept(uint triangle_id, Plane plane, float side) {
    float area = 0.5 * length(plane.normal) / densest_pixel_mm2(plane, side);
    return area >= 0.1 || hash_unit(uvec3(triangle_id, frame.seed, 0u)) < 10.0 * area;
}

float point_columns(uvec4 triangle, Plane plane, float side) {
    // Equation 1: n_tex, the most texels that any texture lays on the triangle.
    uint material = draws[triangle.w].material;
    float texels = materials[material].texels_uv0
        * area(tex_coords[triangle.x], tex_coords[triangle.y], tex_coords[triangle.z]);
    if (VERTEX_EXTRAS != 0)
        texels = max(texels, materials[material].texels_uv1
            * area(vertex_uv1(triangle.x), vertex_uv1(triangle.y), vertex_uv1(triangle.z)));
    if (texels == 0.0) return MOST_COLUMNS;

    // Equation 2: size_uv, a texel's area on the triangle.
    float size_uv = 0.5 * length(plane.normal) / texels;
    float size_xy = densest_pixel_mm2(plane, side);
    // Equation 3, applied along the row.
    return clamp(sqrt(size_uv / size_xy), 1.0, MOST_COLUMNS);
}

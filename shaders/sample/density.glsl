// How dense points must be: the densest view's pixels, and the texture-based limit, equations 1–3 of Gavane
// and Watson 2024. ISOTROPIC and TEXTURE_LIMIT switch what the paper adds to its predecessors.
// Needs: the batch.

#include "common/material.glsl"
#include "common/vertices.glsl"
#include "common/plane.glsl"
#include "common/hash.glsl"

const float MOST_COLUMNS = 16.0;  // bound on a point's length where no texture limits it

float area(vec2 a, vec2 b, vec2 c) {
    vec2 ab = b - a, ac = c - a;
    return 0.5 * abs(ab.x * ac.y - ab.y * ac.x);
}

// |side| of the eye that sees the plane densest.
float densest_side(Plane plane) {
    return max(abs(eye_side(plane, frame.eye_first * frame.column_mm)), abs(eye_side(plane, frame.eye_last * frame.column_mm)));
}

// Area of the densest view pixel on the triangle: a plane sees it at its nearest depth d from the eye
// of the greater side, where it is column·row·d³ / (D²·side/|normal|).
float densest_pixel_mm2(Plane plane) {
    float d = plane.depths.x;
    return frame.column_mm * frame.row_mm * d * d * d * length(plane.normal)
        / (frame.distance_mm * frame.distance_mm * densest_side(plane));
}

// Lengths on the plane, in mm, of a column and a row of a view, projected back to a point p of it: the
// changes of where the ray through p meets the plane.
vec2 pixel_sides_mm(Plane plane, vec3 p, float eye_mm) {
    vec3 ray = p - vec3(eye_mm, 0.0, frame.distance_mm), slope = ray / eye_side(plane, eye_mm);
    float t = max(depth_of(p), frame.near_mm) / frame.distance_mm;
    return t * vec2(frame.column_mm * length(vec3(1.0, 0.0, 0.0) + slope * plane.normal.x),
                    frame.row_mm * length(vec3(0.0, 1.0, 0.0) + slope * plane.normal.y));
}

// Whether stochastic culling keeps a triangle: of those under a tenth of a pixel, with probability
// 10·area (Gavane and Watson 2023, section 3.2). It punches holes in fine meshes, so it is an option.
bool stochastically_kept(uint triangle_id, Plane plane) {
    float area = 0.5 * length(plane.normal) / densest_pixel_mm2(plane);
    return area >= 0.1 || hash_unit(uvec3(triangle_id, frame.seed, 0u)) < 10.0 * area;
}

// Equation 1: n_tex, the most texels that any texture lays on the triangle.
float most_texels(uvec4 triangle) {
    uint material = draw_material(triangle.w);
    vec2 texels_of = material_texels(material);
    float texels = texels_of.x * area(vertex_uv0(triangle.x), vertex_uv0(triangle.y), vertex_uv0(triangle.z));
    if (VERTEX_EXTRAS != 0)
        texels = max(texels, texels_of.y * area(vertex_uv1(triangle.x), vertex_uv1(triangle.y), vertex_uv1(triangle.z)));
    return texels;
}

// Equation 2: size_uv, a texel's area on the triangle; 0 without textures.
float texel_mm2(uvec4 triangle, Plane plane) {
    float texels = most_texels(triangle);
    return texels == 0.0 ? 0.0 : 0.5 * length(plane.normal) / texels;
}

// Length of the points on a window row, in the densest eye's columns. Rows stay dense, since all views
// share them; so isotropic sampling by the denser axis, where that is the column, changes nothing.
float point_columns(uvec4 triangle, vec3 a, vec3 b, vec3 c, Plane plane) {
    float columns = 1.0;
    if (ISOTROPIC != 0) {
        vec2 sides = pixel_sides_mm(plane, (a + b + c) / 3.0, densest_eye_columns(plane) * frame.column_mm);
        columns = clamp(sides.y / sides.x, 1.0 / MOST_COLUMNS, 1.0);
    }
    if (TEXTURE_LIMIT == 0) return columns;
    float size_uv = texel_mm2(triangle, plane);
    if (size_uv == 0.0) return MOST_COLUMNS;
    // Equation 3, applied along the row.
    float size_xy = densest_pixel_mm2(plane) * columns;
    return columns * clamp(sqrt(size_uv / size_xy), 1.0, MOST_COLUMNS / columns);
}

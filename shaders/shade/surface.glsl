// The surface where an eye's ray meets a triangle.

#include "common/triangles.glsl"
#include "common/surface.glsl"
#include "common/vertices.glsl"
#include "common/shading.glsl"

layout(std430) readonly restrict buffer Eyes { float eyes[]; };
layout(std430) readonly restrict buffer RowOffsets { float row_offsets[]; };

#include "common/multiview.glsl"

uniform mat4 turn_from_display;  // see Placement

// From vertex a to b and c. What is the same at all three stands still, exactly.
mat2 sides(mat3x2 uv) {
    return mat2(uv[1] - uv[0], uv[2] - uv[0]);
}

bool on_a_line(mat3x2 uv, mat2 sides) {
    vec2 most = max(abs(uv[0]), max(abs(uv[1]), abs(uv[2]))), lengths = abs(sides[0]) + abs(sides[1]);
    return abs(determinant(sides)) <= UV_ROUNDING * max(most.x, most.y) * (lengths.x + lengths.y);
}

Surface surface_of(uint triangle, float eye_mm, Plane plane, Hit hit) {
    uvec4 corners = corners_of(triangle);
    mat3x2 uv0 = mat3x2(vertex_uv0(corners.x), vertex_uv0(corners.y), vertex_uv0(corners.z));
    mat3x2 uv1 = mat3x2(vertex_uv1(corners.x), vertex_uv1(corners.y), vertex_uv1(corners.z));
    uint facing = draw_facing(corners.w);
    vec3 views = LOD_RULE == LOD_MULTIVIEW ? footprint_views(triangle, plane, eye_mm, facing, depth_of(hit.p_display)) : ONE_VIEW;

    Surface surface;
    surface.to_eye = mat3(turn_from_display) * (vec3(eye_mm, 0.0, frame.distance_mm) - hit.p_display);
    surface.place = mat3(turn_from_display) * hit.p_display;
    surface.normal = mat3(vertex_normal(corners.x), vertex_normal(corners.y), vertex_normal(corners.z)) * hit.weights;
    surface.dp_dx = mat3(turn_from_display) * hit.dp_dx;
    surface.dp_dy = mat3(turn_from_display) * hit.dp_dy;
    mat2 sides0 = sides(uv0), sides1 = sides(uv1);
    surface.uv0 = Footprint(uv0 * hit.weights, sides0 * hit.weights_dx.yz, sides0 * hit.weights_dy.yz, views);
    surface.uv1 = Footprint(uv1 * hit.weights, sides1 * hit.weights_dx.yz, sides1 * hit.weights_dy.yz, views);
    surface.line0 = on_a_line(uv0, sides0);
    surface.line1 = on_a_line(uv1, sides1);
    surface.color = mat3x4(vertex_color(corners.x), vertex_color(corners.y), vertex_color(corners.z)) * hit.weights;
    surface.material = draw_material(corners.w);
    surface.back = (eye_side(plane, eye_mm) < 0.0) != ((facing & FACING_MIRRORED) != 0u);
    return surface;
}

Surface surface_at(uint triangle, int view, int row, int column) {
    uvec4 corners = corners_of(triangle);
    vec3 a = position_of(corners.x);
    vec3 b = position_of(corners.y);
    vec3 c = position_of(corners.z);
    float eye_mm = eyes[view] * frame.column_mm;
    Plane plane = triangle_plane(a, b, c);
    return surface_of(triangle, eye_mm, plane, shaded_hit(triangle, a, b, c, plane, eye_mm, row, column));
}

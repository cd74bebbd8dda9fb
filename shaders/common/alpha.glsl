// Whether a triangle's material is opaque at a view pixel.

#include "common/surface.glsl"
#include "common/textures.glsl"
#include "common/vertices.glsl"
#include "common/coverage.glsl"

bool alpha_accepts(uint triangle, Plane plane, float eye_mm, float x_mm, float y_mm, ivec3 pixel) {
    uvec4 corners = triangles[triangle];
    vec3 a = display_positions[corners.x].xyz;
    vec3 b = display_positions[corners.y].xyz;
    vec3 c = display_positions[corners.z].xyz;
    Hit hit = hit_triangle(a, b, c, plane, eye_mm, x_mm, y_mm);
    Vertex va = vertices[corners.x], vb = vertices[corners.y], vc = vertices[corners.z];

    uint material_index = draws[corners.w].material;
    Material material = materials[material_index];
    vec3 alphas = vec3(vertex_color(va).a, vertex_color(vb).a, vertex_color(vc).a);
    float alpha = material.base_color.a * dot(alphas, hit.weights);
    TextureSlot slot = slot_of(material_index, BASE_COLOR);
    if (slot.group >= 0) {
        mat3x2 uv0 = mat3x2(va.uv0, vb.uv0, vc.uv0), uv1 = mat3x2(va.uv1, vb.uv1, vc.uv1);
        Footprint f0 = Footprint(uv0 * hit.weights, uv0 * hit.weights_dx, uv0 * hit.weights_dy);
        Footprint f1 = Footprint(uv1 * hit.weights, uv1 * hit.weights_dx, uv1 * hit.weights_dy);
        alpha *= sample_srgb(slot, slot_footprint(slot, f0, f1)).a;
    }
    return alpha_accepts_value(alpha, material, material_index, pixel);
}

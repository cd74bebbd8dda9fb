// Whether a masked triangle's alpha reaches its cutoff at a view pixel.

#include "common/surface.glsl"
#include "common/textures.glsl"
#include "common/vertices.glsl"

bool alpha_accepts(uint triangle, Plane plane, float eye_mm, float x_mm, float y_mm) {
    uvec4 corners = triangles[triangle];
    vec3 a = display_positions[corners.x].xyz;
    vec3 b = display_positions[corners.y].xyz;
    vec3 c = display_positions[corners.z].xyz;
    Hit hit = hit_triangle(a, b, c, plane, eye_mm, x_mm, y_mm);
    uint material = draws[corners.w].material;
    float alpha = material_base_color(material).a;
    if (VERTEX_EXTRAS != 0)
        alpha *= dot(vec3(vertex_color(corners.x).a, vertex_color(corners.y).a, vertex_color(corners.z).a), hit.weights);
    uint slot = slot_of(material, BASE_COLOR);
    if (slot != NO_TEXTURE) {
        mat3x2 uv0 = mat3x2(tex_coords[corners.x], tex_coords[corners.y], tex_coords[corners.z]);
        mat3x2 uv1 = mat3x2(vertex_uv1(corners.x), vertex_uv1(corners.y), vertex_uv1(corners.z));
        Footprint f0 = Footprint(uv0 * hit.weights, uv0 * hit.weights_dx, uv0 * hit.weights_dy);
        Footprint f1 = Footprint(uv1 * hit.weights, uv1 * hit.weights_dx, uv1 * hit.weights_dy);
        alpha *= sample_srgb(slot, slot_footprint(material, BASE_COLOR, f0, f1)).a;
    }
    return alpha >= alpha_cutoff(material);
}

// Whether a triangle's alpha reaches its material's cutoff at a view pixel. For blended materials that
// is the least alpha that shows, so that clear texels hide nothing blended behind them.

#include "common/surface.glsl"
#include "common/textures.glsl"
#include "common/vertices.glsl"

layout(std430) readonly restrict buffer RowOffsets { float row_offsets[]; };

// eye: in columns.
bool alpha_accepts(uint triangle, float eye, int row, int column) {
    uvec4 corners = corners_of(triangle);
    vec3 a = position_of(corners.x);
    vec3 b = position_of(corners.y);
    vec3 c = position_of(corners.z);
    float x_mm = (float(column) + 0.5 - row_offsets[row]) * frame.column_mm;
    Hit hit = hit_triangle(a, b, c, triangle_plane(a, b, c), eye * frame.column_mm, x_mm, row_centre_mm(row));
    uint material = draw_material(corners.w);
    float alpha = material_base_color(material).a;
    if (VERTEX_EXTRAS != 0)
        alpha *= dot(vec3(vertex_color(corners.x).a, vertex_color(corners.y).a, vertex_color(corners.z).a), hit.weights);
    uint slot = slot_of(material, BASE_COLOR);
    if (slot != NO_TEXTURE) {
        mat3x2 uv0 = mat3x2(vertex_uv0(corners.x), vertex_uv0(corners.y), vertex_uv0(corners.z));
        mat3x2 uv1 = mat3x2(vertex_uv1(corners.x), vertex_uv1(corners.y), vertex_uv1(corners.z));
        Footprint f0 = Footprint(uv0 * hit.weights, uv0 * hit.weights_dx, uv0 * hit.weights_dy, ONE_VIEW);
        Footprint f1 = Footprint(uv1 * hit.weights, uv1 * hit.weights_dx, uv1 * hit.weights_dy, ONE_VIEW);
        alpha *= sample_srgb(slot, slot_footprint(material, BASE_COLOR, f0, f1), ALPHA_RULE).a;
    }
    return alpha >= alpha_cutoff(material);
}

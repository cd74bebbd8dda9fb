// Multi-view rendering, one pass a view: shade each fragment that passes the depth test so far.
// Row 0 of the raster is the top row, so screen y derivatives run downward as rows do.

#include "common/frame.glsl"
#include "common/shading.glsl"
#include "common/coverage.glsl"

in vec3 p_world;
in vec3 normal_world;
in vec4 uv01;
in vec4 color;
flat in uint material_index;

uniform vec3 eye_world;
uniform int view;
uniform int facing_sign;  // −1 where the placement mirrors

layout(location = 0) out vec4 radiance;

void main() {
    Surface surface;
    surface.p_world = p_world;
    surface.normal = normal_world;
    surface.dp_dx = dFdx(p_world);
    surface.dp_dy = dFdy(p_world);
    surface.uv0 = Footprint(uv01.xy, dFdx(uv01.xy), dFdy(uv01.xy));
    surface.uv1 = Footprint(uv01.zw, dFdx(uv01.zw), dFdy(uv01.zw));
    surface.color = color;
    surface.material = material_index;
    // Row 0 is at the bottom of GL's raster, which turns every triangle's winding over.
    surface.back = gl_FrontFacing == (facing_sign > 0);

    if (ALPHA_TESTED != 0) {
        Material material = materials[material_index];
        float alpha = material.base_color.a * color.a;
        TextureSlot slot = slot_of(material_index, BASE_COLOR);
        if (slot.group >= 0) alpha *= sample_srgb(slot, slot_footprint(slot, surface.uv0, surface.uv1)).a;
        ivec3 pixel = ivec3(ivec2(gl_FragCoord.xy) + ivec2(0, frame.band_first), view);
        if (!alpha_accepts_value(alpha, material, material_index, pixel)) discard;
    }
    radiance = vec4(shade(surface, eye_world), 1.0);
}

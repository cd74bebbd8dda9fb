// What deferred shading of a light field would need of the nearest surfaces, three vectors a pixel.
// In: corners, materials. Out: base colour, metallic; shading normal (world), roughness; p_display (mm), 1.

#include "raster/fragment.glsl"

layout(location = 0) out vec4 color_metallic;
layout(location = 1) out vec4 normal_roughness;
layout(location = 2) out vec4 place;

void main() {
    keep_to_part();
    Surface surface = fragment_surface();
    vec4 color = base_color_of(surface, LOD_RULE);
    if (ALPHA_TESTED != 0) {
        float alpha = ALPHA_RULE == LOD_RULE ? color.a : base_color_of(surface, ALPHA_RULE).a;
        if (alpha < alpha_cutoff(surface.material)) discard;
    }
    vec3 maps = occlusion_roughness_metallic(surface);
    color_metallic = vec4(color.rgb, maps.b);
    normal_roughness = vec4(shading_normal(surface), maps.g);
    place = vec4(corner.p_display, 1.0);
}

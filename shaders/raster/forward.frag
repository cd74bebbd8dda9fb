// Forward shading: each fragment that passes the depth test so far.
// In: corners, materials, lights. Out: radiance, opacity.

#include "raster/fragment.glsl"

layout(location = 0) out vec4 radiance;

void main() {
    keep_to_part();
    Surface surface = fragment_surface();
    radiance = shade(surface);
    if (ALPHA_TESTED != 0) {
        float alpha = ALPHA_RULE == LOD_RULE ? radiance.a : base_color_of(surface, ALPHA_RULE).a;
        if (alpha < alpha_cutoff(surface.material)) discard;
    }
    if (BLENDED == 0) radiance.a = 1.0;
}

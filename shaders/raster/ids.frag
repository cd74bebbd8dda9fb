// Which triangle is nearest: its global id. Targets without colours keep its depth alone.
// In: corners, materials. Out: id.

#include "raster/fragment.glsl"

layout(location = 0) out uint id;

void main() {
    keep_to_part();
    if (ALPHA_TESTED != 0 && base_color_of(fragment_surface(), ALPHA_RULE).a < alpha_cutoff(corner.material)) discard;
    id = first_triangle + uint(gl_PrimitiveID);
}

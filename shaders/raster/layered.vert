// Multi-view rendering, P(…, ≡): a vertex in the view, and the target's layer, of its instance.
// In: the batch, RasterViews.

#extension GL_ARB_shader_viewport_layer_array : require

#include "raster/each.glsl"

void main() {
    place_corner(first_view + gl_InstanceID);
    gl_Layer = gl_InstanceID;
}

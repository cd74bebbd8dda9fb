// Multi-view rendering, P(…, ≈): the driver runs the vertex once for each view of the pass.
// In: the batch, RasterViews.

#extension GL_OVR_multiview2 : require

layout(num_views = VIEWS_A_PASS) in;

#include "raster/each.glsl"

void main() {
    place_corner(first_view + int(gl_ViewID_OVR));
}

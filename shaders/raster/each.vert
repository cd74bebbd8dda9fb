// Multi-view rendering: a vertex through one view's frustum. One instance: direct forwarding, P(N, →);
// several: one for each view of the pass, in its part of the target, P(…, ≡).
// In: the batch, RasterViews.

#include "raster/each.glsl"

void main() {
    place_corner(first_view + gl_InstanceID);
}

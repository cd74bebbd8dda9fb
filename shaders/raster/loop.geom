// Multi-view rendering, P(…, ⋈): a loop over the views of the pass.
// In: corners, RasterViews.

layout(triangles) in;
layout(triangle_strip, max_vertices = 3 * VIEWS_A_PASS) out;

#include "raster/amplify.glsl"

void main() {
    for (int index = 0; index < views; index++) emit_view(index);
}

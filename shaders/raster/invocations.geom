// Multi-view rendering, P(…, ⇀): an invocation for each view of the pass.
// In: corners, RasterViews.

layout(triangles, invocations = VIEWS_A_PASS) in;
layout(triangle_strip, max_vertices = 3) out;

#include "raster/amplify.glsl"

void main() {
    if (gl_InvocationID < views) emit_view(gl_InvocationID);
}

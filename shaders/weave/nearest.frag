// Weaving of nearest views, a fragment a panel pixel. Out: panel pixels, linear light or codes as the view images
// are. Row 0 of the target is the panel's top row.

#include "weave/nearest.glsl"

layout(location = 0) out vec4 panel;

void main() {
    panel = woven(ivec2(gl_FragCoord.xy));
}

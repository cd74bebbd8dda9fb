// Vertices of a batch, local space → display space.
// In: LocalPositions (xyz, draw index as bits), Draws. Out: DisplayPositions (xyz, w = 1).

layout(local_size_x = 128) in;

#include "layout/Draw"

layout(std430) readonly restrict buffer LocalPositions { vec4 local_positions[]; };
layout(std430) readonly restrict buffer Draws { Draw draws[]; };
layout(std430) writeonly restrict buffer DisplayPositions { vec4 display_positions[]; };

uniform uint vertices;

void main() {
    uint vertex = gl_GlobalInvocationID.x;
    if (vertex >= vertices) return;
    vec4 local = local_positions[vertex];
    uint draw = floatBitsToUint(local.w);
    vec4 p_display = draws[draw].display_from_local * vec4(local.xyz, 1.0);
    display_positions[vertex] = vec4(p_display.xyz, 1.0);
}

// Visible triangles and their rows in each segment of SEGMENT triangles.
// In: Spans. Out: Segments (visible, rows).

layout(local_size_x = 64) in;

#include "common/frame.glsl"
#include "layout/Span"

layout(std430) readonly restrict buffer Spans { Span spans[]; };
layout(std430) writeonly restrict buffer Segments { uvec2 segments[]; };

void main() {
    uint segment = gl_GlobalInvocationID.x;
    uint first = segment * SEGMENT, end = min(first + SEGMENT, frame.triangles);
    if (first >= frame.triangles) return;
    uvec2 total = uvec2(0u);
    for (uint t = first; t < end; t++) {
        uint rows = spans[t].rows >> 16;
        total += uvec2(min(rows, 1u), rows);
    }
    segments[segment] = total;
}

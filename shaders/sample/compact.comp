// The list of visible triangles with the number of items (rows) before each, in their order.
// In: Spans, Segments (exclusive sums). Out: VisibleTriangles, ItemStarts (the visible triangle that holds each
// ITEM_STEPth item, from which a search for an item goes on).

layout(local_size_x = 64) in;

#include "common/frame.glsl"
#include "layout/Span"
#include "layout/Visible"

layout(std430) readonly restrict buffer Spans { Span spans[]; };
layout(std430) readonly restrict buffer Segments { uvec2 segments[]; };
layout(std430) writeonly restrict buffer VisibleTriangles { Visible visible[]; };
layout(std430) writeonly restrict buffer ItemStarts { uint item_starts[]; };

void main() {
    uint segment = gl_GlobalInvocationID.x;
    uint first = segment * SEGMENT, end = min(first + SEGMENT, frame.triangles);
    if (first >= frame.triangles) return;
    uvec2 running = segments[segment];
    for (uint t = first; t < end; t++) {
        uint rows = spans[t].rows >> 16;
        if (rows == 0u) continue;
        visible[running.x] = Visible(t, running.y);
        uint steps = min((running.y + rows + ITEM_STEP - 1u) / ITEM_STEP, item_starts.length());
        for (uint s = (running.y + ITEM_STEP - 1u) / ITEM_STEP; s < steps; s++) item_starts[s] = running.x;
        running += uvec2(1u, rows);
    }
}

// How many of a window's rows of points lie on each window row of the band. A work group takes GROUP_TRIANGLES visible
// triangles.
// In: Spans, VisibleTriangles, Work. In, out: Bins (counts).

layout(local_size_x = LANES) in;

#include "common/frame.glsl"
#include "sample/items.glsl"

layout(std430) restrict buffer Bins { uint bins[]; };

void main() {
    uint window_first = work[window].first_item, window_end = window_first + work[window].items;
    uint first = (gl_WorkGroupID.y * GROUPS_ACROSS + gl_WorkGroupID.x) * GROUP_TRIANGLES, end = min(first + GROUP_TRIANGLES, work[window].visible);
    for (uint i = first + gl_LocalInvocationID.x; i < end; i += LANES) {
        Visible seen = visible[i];
        uint rows = spans[seen.triangle].rows;
        uint from = max(seen.first_item, window_first), to = min(seen.first_item + (rows >> 16), window_end);
        uint bin = (rows & 0xFFFFu) - uint(frame.band_first) + from - seen.first_item;
        for (uint item = from; item < to; item++) atomicAdd(bins[bin++], 1u);
    }
}

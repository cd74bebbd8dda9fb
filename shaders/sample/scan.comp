// Exclusive prefix sum over the segments, in place, by one work group; then the counts of each window
// of items, by which the later steps dispatch themselves. Items beyond the windows are not lost:
// MostItems tells the host, which enlarges the windows and repeats the frame.
// In, out: Segments. Out: Work, MostItems.

#define THREADS 256u
layout(local_size_x = 256) in;

#include "layout/Work"

layout(std430) restrict buffer Segments { uvec2 segments[]; };
layout(std430) writeonly restrict buffer WorkBlock { Work work[]; };
layout(std430) restrict buffer MostItems { uint most_items; };  // over all calls

uniform uint segment_count;
uniform uint view_blocks;
uniform uint window_items;

shared uvec2 sums[THREADS];

void main() {
    uint thread = gl_LocalInvocationID.x;
    uint each = (segment_count + THREADS - 1u) / THREADS;
    uint first = thread * each, end = min(first + each, segment_count);

    uvec2 own = uvec2(0u);
    for (uint s = first; s < end; s++) own += segments[s];
    sums[thread] = own;
    barrier();

    for (uint stride = 1u; stride < THREADS; stride *= 2u) {
        uvec2 before = thread >= stride ? sums[thread - stride] : uvec2(0u);
        barrier();
        sums[thread] += before;
        barrier();
    }

    uvec2 running = sums[thread] - own;
    for (uint s = first; s < end; s++) {
        uvec2 here = segments[s];
        segments[s] = running;
        running += here;
    }

    if (thread == THREADS - 1u) {
        uvec2 total = sums[thread];
        atomicMax(most_items, total.y);
        // Not a uniform: Mesa makes uniforms that bound loops constants, and zink's Mesa 22.3 does not
        // see them change.
        for (uint w = 0u; w < uint(work.length()); w++) {
            uint begin = min(w * window_items, total.y), items = min(window_items, total.y - begin);
            uint groups = (items + 63u) / 64u, splats = (items + GROUP_ROWS - 1u) / GROUP_ROWS;
            work[w] = Work(
                min(splats, GROUPS_ACROSS), (splats + GROUPS_ACROSS - 1u) / GROUPS_ACROSS, view_blocks,
                min(groups, GROUPS_ACROSS), (groups + GROUPS_ACROSS - 1u) / GROUPS_ACROSS, 1u,
                begin, items, total.x);
        }
    }
}

// Exclusive prefix sum over the segments, in place, by one work group; then the counts that splatting
// dispatches by, so that nothing is read back.
// In, out: Segments. Out: Work.

#define THREADS 256u
layout(local_size_x = 256) in;

#include "layout/Work"

layout(std430) restrict buffer Segments { uvec2 segments[]; };
layout(std430) writeonly restrict buffer WorkBlock { Work work; };

uniform uint segment_count;
uniform uint view_blocks;

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
        uint groups = (total.y + GROUP_ITEMS - 1u) / GROUP_ITEMS;
        uint across = min(groups, GROUPS_ACROSS);
        work = Work(across, (groups + GROUPS_ACROSS - 1u) / GROUPS_ACROSS, view_blocks, total.x, total.y);
    }
}

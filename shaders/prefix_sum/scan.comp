// Exclusive prefix sum over the segments, in place, by one work group, the total of all, and what dispatches a work group
// for each GROUP_UNITS units of it.
// In, out: Segments. Out: Total (the total, and the most that it was since the host last looked), Dispatch.

#define THREADS 256u
layout(local_size_x = 256) in;

layout(std430) restrict buffer Segments { uint segments[]; };
layout(std430) restrict buffer Total { uint total[]; };
layout(std430) writeonly restrict buffer Dispatch { uint dispatch[]; };

uniform uint most_units;

shared uint sums[THREADS];

void main() {
    uint thread = gl_LocalInvocationID.x, count = uint(segments.length());
    uint each = (count + THREADS - 1u) / THREADS;
    uint first = min(thread * each, count), end = min(first + each, count);

    uint own = 0u;
    for (uint s = first; s < end; s++) own += segments[s];
    sums[thread] = own;
    barrier();

    for (uint stride = 1u; stride < THREADS; stride *= 2u) {
        uint before = thread >= stride ? sums[thread - stride] : 0u;
        barrier();
        sums[thread] += before;
        barrier();
    }

    uint running = sums[thread] - own;
    for (uint s = first; s < end; s++) {
        uint here = segments[s];
        segments[s] = running;
        running += here;
    }
    if (thread == THREADS - 1u) {
        total[0] = running;
        total[1] = max(total[1], running);
        uint groups = (min(running, most_units) + GROUP_UNITS - 1u) / GROUP_UNITS;
        dispatch[0] = min(groups, GROUPS_ACROSS);
        dispatch[1] = (groups + GROUPS_ACROSS - 1u) / GROUPS_ACROSS;
        dispatch[2] = 1u;
    }
}

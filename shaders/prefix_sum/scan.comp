// Exclusive prefix sum over the segments, in place, by one work group, and the total of all.
// In, out: Segments. Out: Total (the total, and the most that it was since the host last looked).

#define THREADS 256u
layout(local_size_x = 256) in;

layout(std430) restrict buffer Segments { uint segments[]; };
layout(std430) restrict buffer Total { uint total[]; };

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
    }
}

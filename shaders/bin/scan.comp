// Exclusive prefix sum over the bins, in place, by one work group. What the longest bin holds goes to
// the host, which splats again when it has not splatted all of it.
// In, out: Bins (counts, then where each starts). Out: Longest.

#define THREADS 256u
layout(local_size_x = 256) in;

layout(std430) restrict buffer Bins { uint bins[]; };
layout(std430) restrict buffer Longest { uint longest; };  // over all calls

shared uint sums[THREADS];

void main() {
    uint thread = gl_LocalInvocationID.x, count = uint(bins.length());
    uint each = (count + THREADS - 1u) / THREADS;
    uint first = min(thread * each, count), end = min(first + each, count);

    uint own = 0u, most = 0u;
    for (uint bin = first; bin < end; bin++) {
        own += bins[bin];
        most = max(most, bins[bin]);
    }
    if (most > 0u) atomicMax(longest, most);
    sums[thread] = own;
    barrier();

    for (uint stride = 1u; stride < THREADS; stride *= 2u) {
        uint before = thread >= stride ? sums[thread - stride] : 0u;
        barrier();
        sums[thread] += before;
        barrier();
    }

    uint running = sums[thread] - own;
    for (uint bin = first; bin < end; bin++) {
        uint here = bins[bin];
        bins[bin] = running;
        running += here;
    }
}

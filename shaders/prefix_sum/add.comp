// Each value becomes the sum of all before it.
// In: Segments (what comes before each), Limit. In, out: Values.

layout(local_size_x = 64) in;

#include "prefix_sum/values.glsl"

void main() {
    uint segment = gl_GlobalInvocationID.x, first = segment * SEGMENT;
    uint end = min(first + SEGMENT, value_count());
    if (first >= end) return;
    uint running = segments[segment];
    for (uint i = first; i < end; i++) {
        uint here = values[word_of(i)];
        values[word_of(i)] = running;
        running += here;
    }
}

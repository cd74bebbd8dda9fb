// Sums of segments of SEGMENT values, one thread a segment.
// In: Values, Limit. Out: Segments.

layout(local_size_x = 64) in;

#include "prefix_sum/values.glsl"

void main() {
    uint segment = gl_GlobalInvocationID.x, first = segment * SEGMENT;
    uint end = min(first + SEGMENT, value_count());
    if (segment >= segments.length()) return;
    uint sum = 0u;
    for (uint i = first; i < end; i++) sum += values[word_of(i)];
    segments[segment] = sum;
}

// The winner of a view pixel that no other invocation touches: nearest depth, then the smaller triangle,
// compared and stored without atomics. The same winner as by atomics.

layout(std430) restrict buffer Depths { uint depths[]; };
layout(std430) restrict buffer Words { uint words[]; };

void visit(uint pixel, float depth, uint id) {
    uint bits = floatBitsToUint(depth), nearest = depths[pixel];  // positive floats order as their bits
    if (bits > nearest || (bits == nearest && id >= words[pixel])) return;
    depths[pixel] = bits;
    words[pixel] = id;
}

void tried(uint pixels) {}  // counted by splat/visit_count.glsl

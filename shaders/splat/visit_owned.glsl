// The winner of a view pixel that no other invocation touches: nearest depth, then the smaller triangle, in one
// 64-bit word, depth above id, which a software device loads and stores at once. The same winner as by atomics.

layout(std430) restrict buffer Winners { uint64_t winners[]; };

void visit(uint pixel, float depth, uint id) {
    uint64_t word = packUint2x32(uvec2(id, floatBitsToUint(depth)));  // positive floats order as their bits
    if (word < winners[pixel]) winners[pixel] = word;
}

void tried(uint pixels) {}  // counted by splat/visit_count.glsl

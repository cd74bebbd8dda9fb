// The winner of a view pixel: nearest depth, then the smaller triangle, in one 64-bit word, depth above
// id. The same winner as by two passes, and as independent of the order of points.

layout(std430) restrict buffer Winners { uint64_t winners[]; };

void visit(uint pixel, float depth, uint id) {
    atomicMin(winners[pixel], packUint2x32(uvec2(id, floatBitsToUint(depth))));
}

void tried(uint pixels) {}  // counted by splat/visit_count.glsl

// The winner of a view pixel: nearest depth, then the smaller triangle. Two passes of 32-bit atomics:
// STEP 0 finds the depth, STEP 1 the smallest id among the triangles at that depth. The result does
// not depend on the order of points.

layout(std430) restrict buffer Depths { uint depths[]; };
layout(std430) restrict buffer Words { uint words[]; };

void visit(uint pixel, float depth, uint id) {
    uint bits = floatBitsToUint(depth);  // positive floats order as their bits
    if (STEP == 0) atomicMin(depths[pixel], bits);
    else if (depths[pixel] == bits) atomicMin(words[pixel], id);
}

void tried(uint pixels) {}  // counted by splat/visit_count.glsl

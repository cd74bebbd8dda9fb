// Counts instead of winners: how many pixels points try, at least one for each view that a row of points or
// a point faces, and how many of those they keep, being inside the triangle and opaque. Run only when asked.

#include "layout/Pairs"

layout(std430) restrict buffer PairsBlock { Pairs pairs; };

uint own_tried = 0u, own_kept = 0u;

void tried(uint pixels) {
    own_tried += pixels;
}

void visit(uint pixel, float depth, uint id) {
    own_kept++;
}

// 64 bits in two words: whoever makes the low one run over adds the carry.
void settle() {
    if (atomicAdd(pairs.tried_low, own_tried) > 0xFFFFFFFFu - own_tried) atomicAdd(pairs.tried_high, 1u);
    if (atomicAdd(pairs.kept_low, own_kept) > 0xFFFFFFFFu - own_kept) atomicAdd(pairs.kept_high, 1u);
}

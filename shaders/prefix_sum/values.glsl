// What the three steps of a prefix sum share.

layout(std430) restrict buffer Values { uint values[]; };
layout(std430) restrict buffer Segments { uint segments[]; };
layout(std430) readonly restrict buffer Limit { uint limit[]; };

// The word of a value.
uint word_of(uint value) {
    return STRIDE * value + STRIDE - 1u;
}

uniform uint capacity;  // values there is room for

// How many values count: as many as Limit says, if there is room for them.
uint value_count() {
    return min(limit[0], capacity);
}

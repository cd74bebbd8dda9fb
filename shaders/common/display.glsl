// Vertices of the batch in display space. By texel fetch, as all geometry and materials are: software devices take four
// words at once by it, and from storage blocks one.

#include "common/octahedral.glsl"

uniform usamplerBuffer DisplayVertices;  // a position's bits, then its normal in the world

vec3 position_of(uint vertex) {
    return uintBitsToFloat(texelFetch(DisplayVertices, int(vertex)).xyz);
}

vec3 vertex_normal(uint vertex) {
    return direction_from(texelFetch(DisplayVertices, int(vertex)).w);
}

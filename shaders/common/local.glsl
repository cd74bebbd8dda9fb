// Vertices of the batch as files have them.

uniform usamplerBuffer LocalPositions;  // bits of x, y, z, and the draw

vec3 local_position(uint vertex) {
    return uintBitsToFloat(texelFetch(LocalPositions, int(vertex)).xyz);
}

uint draw_of_vertex(uint vertex) {
    return texelFetch(LocalPositions, int(vertex)).w;
}

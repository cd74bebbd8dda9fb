// Texture coordinates and colours of vertices. Few scenes have a second coordinate set or colours; without
// them VERTEX_EXTRAS is 0 and nothing is loaded.

uniform usamplerBuffer TexCoords;  // of two vertices a texel
uniform usamplerBuffer VertexExtras;  // a texel a VertexExtra

vec2 vertex_uv0(uint vertex) {
    uvec4 two = texelFetch(TexCoords, int(vertex >> 1));
    return uintBitsToFloat((vertex & 1u) == 0u ? two.xy : two.zw);
}

vec2 vertex_uv1(uint vertex) {
    return VERTEX_EXTRAS != 0 ? uintBitsToFloat(texelFetch(VertexExtras, int(vertex)).xy) : vec2(0.0);
}

vec4 vertex_color(uint vertex) {
    if (VERTEX_EXTRAS == 0) return vec4(1.0);
    uvec4 extra = texelFetch(VertexExtras, int(vertex));
    return vec4(unpackUnorm2x16(extra.z), unpackUnorm2x16(extra.w));
}

// What views share of a surface's light, in four words: scattered and sent radiance and roughness in halves; the square
// root of f0 in thirds of a word, and whether there is gloss; the normal in 24 bits and occlusion in a byte.

// To the nearest half float, which conversion then keeps: software devices cut.
vec4 nearest_half(vec4 x) {
    return uintBitsToFloat(floatBitsToUint(x) + 0x1000u & ~0x1FFFu);
}

uvec4 packed_matte(Matte matte) {
    vec4 radiance_rough = nearest_half(vec4(min(matte.radiance, MOST_RADIANCE), matte.roughness));
    uvec3 f0 = uvec3(1020.0 * sqrt(clamp(matte.f0, 0.0, 1.0)) + 0.5);
    vec3 n = matte.normal / (abs(matte.normal.x) + abs(matte.normal.y) + abs(matte.normal.z));
    uvec2 normal = uvec2(4095.0 * (0.5 + 0.5 * (n.z < 0.0 ? folded(n.xy) : n.xy)) + 0.5);
    uint open = uint(255.0 * clamp(matte.occlusion, 0.0, 1.0) + 0.5);
    return uvec4(packHalf2x16(radiance_rough.rg), packHalf2x16(radiance_rough.ba),
                 f0.r | f0.g << 10 | f0.b << 20 | (matte.glossy ? 1u << 30 : 0u), normal.x | normal.y << 12 | open << 24);
}

Matte matte_from(uvec4 words) {
    vec3 root = vec3(uvec3(words.z, words.z >> 10, words.z >> 20) & 1023u) * (1.0 / 1020.0);
    vec2 blue_rough = unpackHalf2x16(words.y), f = vec2(uvec2(words.w, words.w >> 12) & 4095u) * (2.0 / 4095.0) - 1.0;
    float z = 1.0 - abs(f.x) - abs(f.y);
    return Matte(vec3(unpackHalf2x16(words.x), blue_rough.x), vec3(z < 0.0 ? folded(f) : f, z), root * root, blue_rough.y,
                 float(words.w >> 24) * (1.0 / 255.0), (words.z & 1u << 30) != 0u, 1.0);
}

// Adds a part of one to another.
void add(inout Matte sum, Matte matte, float weight) {
    sum.radiance += weight * matte.radiance;
    sum.normal += weight * matte.normal;
    sum.f0 += weight * matte.f0;
    sum.roughness += weight * matte.roughness;
    sum.occlusion += weight * matte.occlusion;
}

// What lies t of the way from b to c, of four in a row: Catmull and Rom's cubic, which keeps detail that a straight line
// between two would blur.
Matte interpolated(Matte a, Matte b, Matte c, Matte d, float t) {
    Matte sum = Matte(vec3(0.0), vec3(0.0), vec3(0.0), 0.0, 0.0, b.glossy, 1.0);
    add(sum, a, t * (-0.5 + t * (1.0 - 0.5 * t)));
    add(sum, b, 1.0 + t * t * (-2.5 + 1.5 * t));
    add(sum, c, t * (0.5 + t * (2.0 - 1.5 * t)));
    add(sum, d, t * t * (-0.5 + 0.5 * t));
    sum.radiance = max(sum.radiance, 0.0);
    sum.normal *= inversesqrt(max(dot(sum.normal, sum.normal), 1e-20));
    sum.f0 = max(sum.f0, 0.0);
    sum.roughness = clamp(sum.roughness, 0.0, 1.0);
    return sum;
}

// What views share of a surface's light, in four words: scattered and sent radiance and roughness in halves; the square
// root of f0 in thirds of a word, and whether there is gloss; the normal in 24 bits and occlusion in a byte.

#include "common/half.glsl"

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

vec3 radiance_from(uvec2 words) {
    return vec3(unpackHalf2x16(words.x), unpackHalf2x16(words.y).x);
}

// Between b and c, t of the way; radiance, which has the finest detail, by Catmull and Rom's cubic through the radiance of
// their neighbours a and d, too, since a straight line blurs.
Matte interpolated(vec3 a, Matte b, Matte c, vec3 d, float t) {
    vec3 radiance = b.radiance + 0.5 * t * (c.radiance - a + t * (2.0 * a - 5.0 * b.radiance + 4.0 * c.radiance - d
                                                                  + t * (3.0 * (b.radiance - c.radiance) + d - a)));
    vec3 normal = mix(b.normal, c.normal, t);
    return Matte(max(radiance, 0.0), normal * inversesqrt(max(dot(normal, normal), 1e-20)), mix(b.f0, c.f0, t),
                 mix(b.roughness, c.roughness, t), mix(b.occlusion, c.occlusion, t), b.glossy, 1.0);
}

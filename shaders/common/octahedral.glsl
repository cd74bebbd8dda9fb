// Unit vectors in 2 × snorm16 (Cigolle et al. 2014, "A survey of efficient representations of unit
// vectors").

vec2 folded(vec2 f) {
    return (1.0 - abs(f.yx)) * vec2(f.x < 0.0 ? -1.0 : 1.0, f.y < 0.0 ? -1.0 : 1.0);
}

vec3 direction_from(uint word) {
    vec2 f = unpackSnorm2x16(word);
    float z = 1.0 - abs(f.x) - abs(f.y);
    return normalize(vec3(z < 0.0 ? folded(f) : f, z));
}

uint word_from(vec3 direction) {
    vec3 n = direction / max(abs(direction.x) + abs(direction.y) + abs(direction.z), 1e-30);
    return packSnorm2x16(n.z < 0.0 ? folded(n.xy) : n.xy);
}

// Hash to [0, 1]: one round of the PCG permutation (O'Neill 2014) on a mix of the words.
float hash_unit(uvec3 words) {
    uint state = words.x * 747796405u + words.y * 2891336453u + words.z * 277803737u + 1u;
    uint word = ((state >> ((state >> 28) + 4u)) ^ state) * 277803737u;
    return float((word >> 22) ^ word) * (1.0 / 4294967296.0);
}

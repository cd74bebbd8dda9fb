// What the draws of a batch say.

uniform usamplerBuffer Draws;

// A vector of a Draw: four columns take its vertices to display space, three take normals to the world, then come words.
uvec4 draw_words(uint draw, int vector) {
    return texelFetch(Draws, DRAW_TEXELS * int(draw) + vector);
}

mat4 display_from_local(uint draw) {
    return mat4(uintBitsToFloat(draw_words(draw, 0)), uintBitsToFloat(draw_words(draw, 1)),
                uintBitsToFloat(draw_words(draw, 2)), uintBitsToFloat(draw_words(draw, 3)));
}

mat3 normal_matrix(uint draw) {
    return mat3(uintBitsToFloat(draw_words(draw, 4).xyz), uintBitsToFloat(draw_words(draw, 5).xyz),
                uintBitsToFloat(draw_words(draw, 6).xyz));
}

uint draw_material(uint draw) {
    return draw_words(draw, 7).x;
}

// FACING_* bits.
uint draw_facing(uint draw) {
    return draw_words(draw, 7).y;
}

uint first_joint(uint draw) {
    return draw_words(draw, 7).z;
}

uint first_weight(uint draw) {
    return draw_words(draw, 7).w;
}

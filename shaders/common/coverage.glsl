// Alpha: masks cut at their cutoff; blended surfaces are kept by ordered coverage, a threshold that
// runs through [0, 1) over the views of a pixel, so that neighbouring views, which an eye blends,
// average to the right opacity.

#include "common/hash.glsl"

// pixel: column, row, view.
float blend_threshold(ivec3 pixel, uint material) {
    float start = hash_unit(uvec3(uint(pixel.x) + frame.seed * 65537u, uint(pixel.y), material));
    return fract(start + float(pixel.z) * 0.61803399);  // golden ratio: low discrepancy over views
}

bool alpha_accepts_value(float alpha, uint material, ivec3 pixel) {
    uint mode = materials[material].flags & ALPHA_BITS;
    if (mode == ALPHA_MASK) return alpha >= unpackHalf2x16(materials[material].emissive_b_cutoff).y;
    if (mode == ALPHA_BLEND) return alpha > blend_threshold(pixel, material);
    return true;
}

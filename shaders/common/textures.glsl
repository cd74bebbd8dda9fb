// Material textures: 2D arrays grouped by colour space, size and wrap, and the level of detail.

#include "common/material.glsl"

uniform sampler2DArray srgb_maps[SRGB_GROUPS];
uniform sampler2DArray linear_maps[LINEAR_GROUPS];

// A texture coordinate and its change over a column and a row.
struct Footprint {
    vec2 uv;
    vec2 dx;
    vec2 dy;
};

Footprint slot_footprint(TextureSlot slot, Footprint uv0, Footprint uv1) {
    Footprint f = uv0;
    if (slot.texcoord == 1) f = uv1;
    mat2 m = mat2(slot.uv_matrix.xy, slot.uv_matrix.zw);
    return Footprint(m * f.uv + slot.uv_offset, m * f.dx, m * f.dy);
}

// Level of detail by the footprint's area, as equation 6 of Gavane and Watson 2024.
float area_lod(Footprint f, vec2 texels) {
    float area = abs(f.dx.x * f.dy.y - f.dx.y * f.dy.x) * texels.x * texels.y;
    return 0.5 * log2(max(area, 1e-12));
}

// Groups differ between lanes, and sampler indices must not; hence the selection.
vec4 sample_srgb(TextureSlot slot, Footprint f) {
    float lod = area_lod(f, slot.texels);
    vec4 texel = vec4(1.0);
    for (int group = 0; group < SRGB_GROUPS; group++)
        if (slot.group == group) texel = textureLod(srgb_maps[group], vec3(f.uv, slot.layer), lod);
    return texel;
}

vec4 sample_linear(TextureSlot slot, Footprint f) {
    float lod = area_lod(f, slot.texels);
    vec4 texel = vec4(1.0);
    for (int group = 0; group < LINEAR_GROUPS; group++)
        if (slot.group == group) texel = textureLod(linear_maps[group], vec3(f.uv, slot.layer), lod);
    return texel;
}

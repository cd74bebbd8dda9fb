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

Footprint slot_footprint(uint material, uint role, Footprint uv0, Footprint uv1) {
    Footprint f = uv0;
    uint slot = slot_of(material, role);
    if (VERTEX_EXTRAS != 0 && (slot >> (SLOT_GROUP_BITS + SLOT_LAYER_BITS)) == 1u) f = uv1;
    if (UV_TRANSFORMS == 0) return f;
    UvTransform transform = uv_transforms[material * TEXTURE_ROLES + role];
    mat2 m = mat2(transform.matrix.xy, transform.matrix.zw);
    return Footprint(m * f.uv + transform.offset, m * f.dx, m * f.dy);
}

// Level of detail by the footprint's area, as equation 6 of Gavane and Watson 2024.
float area_lod(Footprint f, vec2 texels) {
    float area = abs(f.dx.x * f.dy.y - f.dx.y * f.dy.x) * texels.x * texels.y;
    return 0.5 * log2(max(area, 1e-12));
}

int slot_group(uint slot) {
    return int(slot & ((1u << SLOT_GROUP_BITS) - 1u));
}

vec3 slot_place(uint slot, Footprint f) {
    return vec3(f.uv, float(slot >> SLOT_GROUP_BITS & ((1u << SLOT_LAYER_BITS) - 1u)));
}

// Groups differ between lanes, and sampler indices must not; hence the selection.
vec4 sample_srgb(uint slot, Footprint f) {
    vec4 texel = vec4(1.0);
    for (int group = 0; group < SRGB_GROUPS; group++) {
        float lod = area_lod(f, vec2(textureSize(srgb_maps[group], 0).xy));
        if (slot_group(slot) == group) texel = textureLod(srgb_maps[group], slot_place(slot, f), lod);
    }
    return texel;
}

vec4 sample_linear(uint slot, Footprint f) {
    vec4 texel = vec4(1.0);
    for (int group = 0; group < LINEAR_GROUPS; group++) {
        float lod = area_lod(f, vec2(textureSize(linear_maps[group], 0).xy));
        if (slot_group(slot) == group) texel = textureLod(linear_maps[group], slot_place(slot, f), lod);
    }
    return texel;
}

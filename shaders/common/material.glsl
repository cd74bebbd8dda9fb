// Materials and their texture slots. ROLES is a mask of the texture roles that any material of the
// scene uses; the others cost nothing.

#include "layout/Material"
#include "layout/UvTransform"

layout(std430) readonly restrict buffer Materials { Material materials[]; };
layout(std430) readonly restrict buffer TextureSlots { uint texture_slots[]; };
layout(std430) readonly restrict buffer UvTransforms { UvTransform uv_transforms[]; };

const uint BASE_COLOR = 0u, METALLIC_ROUGHNESS = 1u, NORMAL = 2u, OCCLUSION = 3u, EMISSIVE = 4u;

vec4 material_base_color(uint material) {
    return vec4(unpackUnorm2x16(materials[material].base_color_rg), unpackUnorm2x16(materials[material].base_color_ba));
}

uint slot_of(uint material, uint role) {
    if ((ROLES >> role & 1u) == 0u) return NO_TEXTURE;
    return texture_slots[material * TEXTURE_ROLES + role];
}

float alpha_cutoff(uint material) {
    return unpackHalf2x16(materials[material].emissive_b_cutoff).y;
}

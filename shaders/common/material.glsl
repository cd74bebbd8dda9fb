// Materials and their texture slots. ROLES is a mask of the texture roles that any material of the
// scene uses; the others cost nothing.

#include "layout/UvTransform"

uniform usamplerBuffer Materials;  // MATERIAL_TEXELS a Material
layout(std430) readonly restrict buffer UvTransforms { UvTransform uv_transforms[]; };

const uint BASE_COLOR = 0u, METALLIC_ROUGHNESS = 1u, NORMAL = 2u, OCCLUSION = 3u, EMISSIVE = 4u;

uvec4 material_texel(uint material, int texel) {
    return texelFetch(Materials, MATERIAL_TEXELS * int(material) + texel);
}

vec4 material_base_color(uint material) {
    uvec4 words = material_texel(material, 0);
    return vec4(unpackUnorm2x16(words.x), unpackUnorm2x16(words.y));
}

vec2 metallic_roughness(uint material) {
    return unpackUnorm2x16(material_texel(material, 0).z);
}

float normal_scale(uint material) {
    return unpackHalf2x16(material_texel(material, 0).w).x;
}

float occlusion_strength(uint material) {
    return unpackHalf2x16(material_texel(material, 0).w).y;
}

vec3 emissive_factor(uint material) {
    uvec4 words = material_texel(material, 1);
    return vec3(unpackHalf2x16(words.x), unpackHalf2x16(words.y).x);
}

float alpha_cutoff(uint material) {
    return unpackHalf2x16(material_texel(material, 1).y).y;
}

bool is_unlit(uint material) {
    return (material_texel(material, 1).z & UNLIT) != 0u;
}

uint slot_of(uint material, uint role) {
    if ((ROLES >> role & 1u) == 0u) return NO_TEXTURE;
    return role == EMISSIVE ? material_texel(material, 1).w : material_texel(material, 2)[role];
}

// Most texels that any texture lays on a unit of texture area, by coordinate set.
vec2 material_texels(uint material) {
    return uintBitsToFloat(material_texel(material, 3).xy);
}

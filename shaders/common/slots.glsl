// Texture slots of the materials, TEXTURE_ROLES slots each.

#include "layout/TextureSlot"

layout(std430) readonly restrict buffer TextureSlots { TextureSlot texture_slots[]; };

const uint BASE_COLOR = 0u, METALLIC_ROUGHNESS = 1u, NORMAL = 2u, OCCLUSION = 3u, EMISSIVE = 4u;

TextureSlot slot_of(uint material, uint role) {
    return texture_slots[material * TEXTURE_ROLES + role];
}

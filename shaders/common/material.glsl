// Materials, with their texture slots.

#include "layout/Material"
#include "common/slots.glsl"

layout(std430) readonly restrict buffer Materials { Material materials[]; };

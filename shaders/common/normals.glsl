// Normals of vertices in the world. They stand apart since devices allow only 16 blocks a shader.

#include "common/octahedral.glsl"

layout(std430) readonly restrict buffer WorldNormals { uint world_normals[]; };

vec3 vertex_normal(uint vertex) {
    return direction_from(world_normals[vertex]);
}

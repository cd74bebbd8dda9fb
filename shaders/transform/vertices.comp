// Vertices of a batch, local space → display space, and their normals, local → world.
// In: LocalPositions (xyz, draw index as bits), LocalNormals, Draws.
// Out: DisplayPositions (xyz, w = 1), WorldNormals.

layout(local_size_x = 128) in;

#include "layout/Draw"
#include "common/octahedral.glsl"

layout(std430) readonly restrict buffer LocalPositions { vec4 local_positions[]; };
layout(std430) readonly restrict buffer LocalNormals { uint local_normals[]; };
layout(std430) readonly restrict buffer Draws { Draw draws[]; };
layout(std430) writeonly restrict buffer DisplayPositions { vec4 display_positions[]; };
layout(std430) writeonly restrict buffer WorldNormals { uint world_normals[]; };

uniform uint vertices;

void main() {
    uint vertex = gl_GlobalInvocationID.x;
    if (vertex >= vertices) return;
    vec4 local = local_positions[vertex];
    uint draw = floatBitsToUint(local.w);
    vec4 p_display = draws[draw].display_from_local * vec4(local.xyz, 1.0);
    display_positions[vertex] = vec4(p_display.xyz, 1.0);
    vec3 normal = direction_from(local_normals[vertex]);
    world_normals[vertex] = word_from(draws[draw].normal_matrix_x.xyz * normal.x
                                      + draws[draw].normal_matrix_y.xyz * normal.y
                                      + draws[draw].normal_matrix_z.xyz * normal.z);
}

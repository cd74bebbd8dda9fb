// Vertices of a batch, local space → display space, and their normals, local → world.
// In: LocalPositions, LocalNormals, Draws. Out: DisplayVertices (see common/display.glsl).

layout(local_size_x = 128) in;

#include "common/draws.glsl"
#include "common/local.glsl"
#include "common/octahedral.glsl"

layout(std430) readonly restrict buffer LocalNormals { uint local_normals[]; };
layout(std430) writeonly restrict buffer DisplayVertices { uvec4 display_vertices[]; };

uniform uint vertices;

void main() {
    uint vertex = gl_GlobalInvocationID.x;
    if (vertex >= vertices) return;
    uint draw = draw_of_vertex(vertex);
    vec4 p_display = display_from_local(draw) * vec4(local_position(vertex), 1.0);
    vec3 n_world = normal_matrix(draw) * direction_from(local_normals[vertex]);
    display_vertices[vertex] = uvec4(floatBitsToUint(p_display.xyz), word_from(n_world));
}

// Flat normals of deformed triangles, in the world, where a file gives none (glTF 2.0, section 3.7.2.1).
// Such a triangle has three vertices of its own, one after the other; its front is counter-clockwise,
// or clockwise where its draw mirrors.
// In: DisplayPositions, LocalPositions (draw index), Draws. Out: WorldNormals.

layout(local_size_x = 128) in;

#include "layout/Draw"
#include "common/octahedral.glsl"

layout(std430) readonly restrict buffer DisplayPositions { vec4 display_positions[]; };
layout(std430) readonly restrict buffer LocalPositions { vec4 local_positions[]; };
layout(std430) readonly restrict buffer Draws { Draw draws[]; };
layout(std430) writeonly restrict buffer WorldNormals { uint world_normals[]; };

uniform uint first;  // vertex
uniform uint triangles;
uniform mat4 world_from_display_plane;

void main() {
    uint triangle = gl_GlobalInvocationID.x;
    if (triangle >= triangles) return;
    uint vertex = first + 3u * triangle;
    vec3 a = display_positions[vertex].xyz;
    vec3 u = display_positions[vertex + 1u].xyz - a;
    vec3 v = display_positions[vertex + 2u].xyz - a;
    vec3 size = max(abs(u), abs(v));
    float scale = 1.0 / max(max(size.x, max(size.y, size.z)), 1e-30);  // products stay in range
    vec3 normal = cross(scale * u, scale * v);
    bool mirrored = (draws[floatBitsToUint(local_positions[vertex].w)].facing & FACING_MIRRORED) != 0u;
    uint word = word_from((world_from_display_plane * vec4(mirrored ? -normal : normal, 0.0)).xyz);
    world_normals[vertex] = word;
    world_normals[vertex + 1u] = word;
    world_normals[vertex + 2u] = word;
}

// Flat normals of deformed triangles, in the world, where a file gives none (glTF 2.0, section 3.7.2.1).
// Such a triangle has three vertices of its own, one after the other; its front is counter-clockwise,
// or clockwise where its draw mirrors.
// In: LocalPositions, Draws. In, out: DisplayVertices.

layout(local_size_x = 128) in;

#include "common/draws.glsl"
#include "common/facing.glsl"
#include "common/local.glsl"
#include "common/octahedral.glsl"

layout(std430) restrict buffer DisplayVertices { uvec4 display_vertices[]; };

uniform uint first;  // vertex
uniform uint triangles;
uniform mat4 world_from_display_plane;

void main() {
    uint triangle = gl_GlobalInvocationID.x;
    if (triangle >= triangles) return;
    uint vertex = first + 3u * triangle;
    vec3 a = uintBitsToFloat(display_vertices[vertex].xyz);
    vec3 u = uintBitsToFloat(display_vertices[vertex + 1u].xyz) - a;
    vec3 v = uintBitsToFloat(display_vertices[vertex + 2u].xyz) - a;
    vec3 size = max(abs(u), abs(v));
    float scale = 1.0 / max(max(size.x, max(size.y, size.z)), 1e-30);  // products stay in range
    vec3 normal = cross(scale * u, scale * v);
    bool mirrored = (draw_facing(draw_of_vertex(vertex)) & FACING_MIRRORED) != 0u;
    uint word = word_from((world_from_display_plane * vec4(mirrored ? -normal : normal, 0.0)).xyz);
    display_vertices[vertex].w = word;
    display_vertices[vertex + 1u].w = word;
    display_vertices[vertex + 2u].w = word;
}

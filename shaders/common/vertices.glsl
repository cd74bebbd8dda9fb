// Texture coordinates and colours of vertices. Few scenes have a second coordinate set or colours; without
// them VERTEX_EXTRAS is 0 and nothing is loaded.

#include "layout/VertexExtra"

layout(std430) readonly restrict buffer TexCoords { vec2 tex_coords[]; };
layout(std430) readonly restrict buffer VertexExtras { VertexExtra vertex_extras[]; };

vec2 vertex_uv1(uint vertex) {
    return VERTEX_EXTRAS != 0 ? vertex_extras[vertex].uv1 : vec2(0.0);
}

vec4 vertex_color(uint vertex) {
    if (VERTEX_EXTRAS == 0) return vec4(1.0);
    return vec4(unpackUnorm2x16(vertex_extras[vertex].color_rg), unpackUnorm2x16(vertex_extras[vertex].color_ba));
}

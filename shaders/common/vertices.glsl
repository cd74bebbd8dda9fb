// Vertex attributes that shading reads.

#include "layout/Vertex"

layout(std430) readonly restrict buffer Vertices { Vertex vertices[]; };

vec4 vertex_color(Vertex v) {
    return vec4(unpackUnorm2x16(v.color_rg), unpackUnorm2x16(v.color_ba));
}

// Octahedral decoding (Cigolle et al. 2014, "A survey of efficient representations of unit vectors").
vec3 vertex_normal(Vertex v) {
    vec2 f = unpackSnorm2x16(v.normal_oct);
    vec3 n = vec3(f, 1.0 - abs(f.x) - abs(f.y));
    if (n.z < 0.0) n.xy = (1.0 - abs(n.yx)) * vec2(n.x < 0.0 ? -1.0 : 1.0, n.y < 0.0 ? -1.0 : 1.0);
    return normalize(n);
}

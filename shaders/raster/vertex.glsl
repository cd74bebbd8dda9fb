// A vertex of the batch as a corner.
// In: DisplayPositions, vertex attributes, LocalPositions (draw index).

#include "common/vertices.glsl"
#include "common/normals.glsl"
#include "raster/corner.glsl"
#include "layout/Draw"

layout(std430) readonly restrict buffer DisplayPositions { vec4 display_positions[]; };
layout(std430) readonly restrict buffer LocalPositions { vec4 local_positions[]; };
layout(std430) readonly restrict buffer Draws { Draw draws[]; };

out Corner CORNER corner;

void load_corner() {
    corner.p_display = display_positions[gl_VertexID].xyz;
    corner.normal_world = vertex_normal(uint(gl_VertexID));
    corner.uv01 = vec4(tex_coords[gl_VertexID], vertex_uv1(uint(gl_VertexID)));
    corner.color = vertex_color(uint(gl_VertexID));
    corner.material = draws[floatBitsToUint(local_positions[gl_VertexID].w)].material;
}

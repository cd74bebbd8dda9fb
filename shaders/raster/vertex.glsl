// A vertex of the batch as a corner.
// In: DisplayVertices, vertex attributes, LocalPositions, Draws.

#include "common/vertices.glsl"
#include "common/display.glsl"
#include "common/draws.glsl"
#include "common/local.glsl"
#include "raster/corner.glsl"

out Corner CORNER corner;

void load_corner() {
    corner.p_display = position_of(uint(gl_VertexID));
    corner.normal_world = vertex_normal(uint(gl_VertexID));
    corner.uv01 = vec4(vertex_uv0(uint(gl_VertexID)), vertex_uv1(uint(gl_VertexID)));
    corner.color = vertex_color(uint(gl_VertexID));
    corner.material = draw_material(draw_of_vertex(uint(gl_VertexID)));
}

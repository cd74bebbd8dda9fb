// Culling and point density, one thread a triangle (Gavane and Watson 2024, section 3.1, with rows shared
// by all views).
// In: the batch, Draws, materials. Out: Spans.

layout(local_size_x = 128) in;

#include "sample/visible.glsl"
#include "common/vertex_culling.glsl"
#include "sample/density.glsl"
#include "layout/Span"

layout(std430) writeonly restrict buffer Spans { Span spans[]; };

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= frame.triangles) return;
    spans[index] = Span(0u, 1.0);

    uvec4 triangle = corners_of(index);
    vec3 a = position_of(triangle.x);
    vec3 b = position_of(triangle.y);
    vec3 c = position_of(triangle.z);
    Plane plane = triangle_plane(a, b, c);
    ivec2 rows = rows_seen(a, b, c, plane, draw_facing(triangle.w));
    if (rows.y == 0) return;
    if (VERTEX_CULLING != 0 && !vertices_ever_seen(a, b, c)) return;
    if (STOCHASTIC_CULLING != 0 && !stochastically_kept(frame.triangle_base + index, plane)) return;
    spans[index] = Span(uint(rows.x) | uint(rows.y) << 16, point_columns(triangle, a, b, c, plane));
}

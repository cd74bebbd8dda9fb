// Multi-view rendering, one pass a view: a vertex through one view's off-axis frustum.
// In: DisplayPositions, vertex attributes, LocalPositions (draw index). The window's sides clip, since the
// raster is a parallelogram around the window when views follow the lenses.

#include "common/frame.glsl"
#include "common/vertices.glsl"
#include "common/normals.glsl"
#include "layout/Draw"

layout(std430) readonly restrict buffer DisplayPositions { vec4 display_positions[]; };
layout(std430) readonly restrict buffer LocalPositions { vec4 local_positions[]; };
layout(std430) readonly restrict buffer Draws { Draw draws[]; };

uniform mat4 clip_from_display;
uniform float eye_mm;

out vec3 p_display;
out vec3 normal_world;
out vec4 uv01;
out vec4 color;
flat out uint material;

out gl_PerVertex {
    vec4 gl_Position;
    float gl_ClipDistance[2];
};

void main() {
    p_display = display_positions[gl_VertexID].xyz;

    gl_Position = clip_from_display * vec4(p_display, 1.0);
    float d = frame.distance_mm - p_display.z;
    float x_times_d = frame.distance_mm * p_display.x - p_display.z * eye_mm;
    float half_width = 0.5 * frame.panel_width_mm + float(MARGIN_COLUMNS) * frame.column_mm;  // lenses that begin outside
    gl_ClipDistance[0] = x_times_d + half_width * d;
    gl_ClipDistance[1] = half_width * d - x_times_d;

    normal_world = vertex_normal(uint(gl_VertexID));
    uv01 = vec4(tex_coords[gl_VertexID], vertex_uv1(uint(gl_VertexID)));
    color = vertex_color(uint(gl_VertexID));
    material = draws[floatBitsToUint(local_positions[gl_VertexID].w)].material;
}

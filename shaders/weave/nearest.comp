// Weaving of nearest views, an invocation a panel pixel: nearest.frag for devices that compute faster.
// Out: panel, rows [first_panel_row, end_panel_row).

#include "weave/nearest.glsl"

layout(local_size_x = 32, local_size_y = 8) in;

layout(binding = 0) writeonly uniform image2DArray panel;
uniform int first_panel_row;
uniform int end_panel_row;

void main() {
    ivec2 px = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, first_panel_row);
    if (px.x >= PANEL_COLUMNS || px.y >= end_panel_row) return;
    imageStore(panel, ivec3(px, 0), woven(px));
}

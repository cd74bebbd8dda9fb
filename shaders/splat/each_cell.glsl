// A work group takes a point and a lane is a view.

#include "splat/cells.glsl"

void main() {
    uint place = gl_WorkGroupID.y * GROUPS_ACROSS + gl_WorkGroupID.x;
    int view = int(gl_WorkGroupID.z * VIEW_LANES + gl_LocalInvocationID.x);
    if (place >= min(cell_work.points, uint(cells.length())) || view >= frame.views) return;
    splat_cell(cells[place], view, eyes[view]);
}

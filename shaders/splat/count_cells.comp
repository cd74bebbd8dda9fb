// How many pixels points of the paper's lattice try and keep, in one band.
// Inputs: splat/cells.glsl. Out: Pairs.

layout(local_size_x = VIEW_LANES) in;

#include "splat/visit_count.glsl"
#include "splat/cells.glsl"

void main() {
    uint place = gl_WorkGroupID.y * GROUPS_ACROSS + gl_WorkGroupID.x;
    int view = int(gl_WorkGroupID.z * VIEW_LANES + gl_LocalInvocationID.x);
    if (place >= min(cell_work.points, uint(cells.length())) || view >= frame.views) return;
    splat_cell(cells[place], view, eyes[view]);
    settle();
}

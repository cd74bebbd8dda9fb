// How many pixels rows of points try and keep, in one window and band; one work group a row of points.
// Inputs: splat/shear.glsl. Out: Pairs.

layout(local_size_x = VIEW_LANES) in;

#include "splat/visit_count.glsl"
#include "common/points.glsl"
#include "splat/shear.glsl"

void main() {
    uint place = gl_WorkGroupID.y * GROUPS_ACROSS + gl_WorkGroupID.x;
    int view = int(gl_WorkGroupID.z * VIEW_LANES + gl_LocalInvocationID.x);
    if (place >= work[window].items || view >= frame.views) return;
    splat_row(point_rows[place], true, view, eyes[view]);
    settle();
}

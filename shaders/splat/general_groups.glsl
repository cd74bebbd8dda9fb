// A work group takes GROUP_ROWS rows of points and a lane is a view.

#include "splat/general.glsl"

void main() {
    uint first = (gl_WorkGroupID.y * GROUPS_ACROSS + gl_WorkGroupID.x) * GROUP_ROWS;
    int view = int(gl_WorkGroupID.z * VIEW_LANES + gl_LocalInvocationID.x);
    if (view >= frame.views) return;
    for (uint place = first; place < min(first + GROUP_ROWS, work[window].items); place++)
        splat_row(point_rows[place], view);
}

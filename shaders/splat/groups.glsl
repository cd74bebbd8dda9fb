// A work group takes GROUP_ROWS (4) rows of points and a lane is a view. llvmpipe loads once for all lanes
// where the index is the group's and no loop, branch or return has come before, twenty times as fast as
// lane by lane; hence the order here.

#include "common/points.glsl"
#include "splat/shear.glsl"

void main() {
    uint first = (gl_WorkGroupID.y * GROUPS_ACROSS + gl_WorkGroupID.x) * GROUP_ROWS;
    PointRow row_0 = point_rows[first], row_1 = point_rows[first + 1u];
    PointRow row_2 = point_rows[first + 2u], row_3 = point_rows[first + 3u];
    uint items = work[window].items;
    int view = int(gl_WorkGroupID.z * VIEW_LANES + gl_LocalInvocationID.x);
    float eye = eyes[min(view, frame.views - 1)];
    splat_row(row_0, first < items, view, eye);
    splat_row(row_1, first + 1u < items, view, eye);
    splat_row(row_2, first + 2u < items, view, eye);
    splat_row(row_3, first + 3u < items, view, eye);
}

// Each row of points goes to its bin. The order within a bin is that of the atomics and differs from
// run to run; splatting does not depend on it.
// In: PointRows, Work. In, out: Bins (where each starts, then where each ends). Out: BinnedRows.

layout(local_size_x = 64) in;

#include "common/points.glsl"

layout(std430) restrict buffer Bins { uint bins[]; };
layout(std430) writeonly restrict buffer BinnedRows { PointRow binned_rows[]; };

void main() {
    uint place = (gl_WorkGroupID.y * GROUPS_ACROSS + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
    if (place >= work[window].items) return;
    PointRow points = point_rows[place];
    binned_rows[atomicAdd(bins[row_of(points) - frame.band_first], 1u)] = points;
}

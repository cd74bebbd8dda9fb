// How many rows of points lie on each window row of the band; one thread a row of points.
// In: PointRows, Work. In, out: Bins (counts).

layout(local_size_x = 64) in;

#include "common/points.glsl"

layout(std430) restrict buffer Bins { uint bins[]; };

void main() {
    uint place = (gl_WorkGroupID.y * GROUPS_ACROSS + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
    if (place >= work[window].items) return;
    atomicAdd(bins[row_of(point_rows[place]) - frame.band_first], 1u);
}

// How many points the rows of a window hold. Run only when someone asks; one thread a row.
// In: PointRows, Work. Out: PointCount.

layout(local_size_x = 64) in;

#include "common/points.glsl"

layout(std430) restrict buffer PointCount { uint point_count; };

void main() {
    uint place = (gl_WorkGroupID.y * GROUPS_ACROSS + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
    if (place >= work[window].items) return;
    PointRow points = point_rows[place];
    Slice slice = row_slice(points);
    ivec2 cells = row_cells(points, slice);
    if (slice.a != slice.b) atomicAdd(point_count, uint(cells.y - cells.x));
}

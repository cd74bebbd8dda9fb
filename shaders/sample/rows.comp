// The rows of points that splatting reads: one thread an item, an item being a row of a visible
// triangle. Sorted by window row where BINNED is 1; the order within one is that of atomics and differs from run to run.
// In: the batch, Spans, VisibleTriangles, Work, RowOffsets. In, out: Bins (where each begins, then where it ends), where
// BINNED is 1. Out: PointRows, from the window's first.

layout(local_size_x = 64) in;

#include "sample/items.glsl"
#include "layout/PointRow"

layout(std430) readonly restrict buffer RowOffsets { float row_offsets[]; };
layout(std430) restrict buffer Bins { uint bins[]; };
layout(std430) writeonly restrict buffer PointRows { PointRow point_rows[]; };

#include "sample/point_row.glsl"

void main() {
    uint place = (gl_WorkGroupID.y * GROUPS_ACROSS + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
    if (place >= work[window].items) return;
    uint item = work[window].first_item + place;
    Visible seen = visible[visible_at(item)];
    Span span = spans[seen.triangle];
    int row = int((span.rows & 0xFFFFu) + item - seen.first_item);
    if (BINNED != 0) place = atomicAdd(bins[row - frame.band_first], 1u);
    point_rows[place] = point_row(seen.triangle, row);
}

// The rows of points that splatting reads: one thread an item, an item being a row of a visible
// triangle.
// In: the batch, Spans, VisibleTriangles, Work, RowOffsets. Out: PointRows, from the window's first.

layout(local_size_x = 64) in;

#include "sample/items.glsl"
#include "layout/PointRow"

layout(std430) readonly restrict buffer RowOffsets { float row_offsets[]; };
layout(std430) writeonly restrict buffer PointRows { PointRow point_rows[]; };

#include "sample/point_row.glsl"

void main() {
    uint place = (gl_WorkGroupID.y * GROUPS_ACROSS + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
    if (place >= work[window].items) return;
    uint item = work[window].first_item + place;
    Visible seen = visible[visible_at(item)];
    Span span = spans[seen.triangle];
    int row = int((span.rows & 0xFFFFu) + item - seen.first_item);
    point_rows[place] = point_row(seen.triangle, row);
}

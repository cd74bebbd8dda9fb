// The rows of points that splatting reads: one thread an item, an item being a row of a visible
// triangle.
// In: the batch, Spans, VisibleTriangles, Work, RowOffsets. Out: PointRows, from the window's first.

layout(local_size_x = 64) in;

#include "common/triangles.glsl"
#include "common/shear.glsl"
#include "common/plane.glsl"
#include "layout/Span"
#include "layout/Visible"
#include "layout/Work"
#include "layout/PointRow"

layout(std430) readonly restrict buffer Spans { Span spans[]; };
layout(std430) readonly restrict buffer VisibleTriangles { Visible visible[]; };
layout(std430) readonly restrict buffer WorkBlock { Work work[]; };
layout(std430) readonly restrict buffer RowOffsets { float row_offsets[]; };
layout(std430) writeonly restrict buffer PointRows { PointRow point_rows[]; };

uniform int window;

// Index of the visible triangle that holds an item: the last one that starts at or before it.
uint visible_at(uint item) {
    uint low = 0u, high = work[window].visible;
    while (low + 1u < high) {
        uint middle = (low + high) / 2u;
        if (visible[middle].first_item <= item) low = middle;
        else high = middle;
    }
    return low;
}

void main() {
    uint place = (gl_WorkGroupID.y * GROUPS_ACROSS + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
    if (place >= work[window].items) return;
    uint item = work[window].first_item + place;
    Visible seen = visible[visible_at(item)];
    uvec4 corners = triangles[seen.triangle];
    vec3 a = display_positions[corners.x].xyz;
    vec3 b = display_positions[corners.y].xyz;
    vec3 c = display_positions[corners.z].xyz;
    Span span = spans[seen.triangle];
    int row = int((span.rows & 0xFFFFu) + item - seen.first_item);

    Slice slice = slice_triangle(a, b, c, row, row_offsets[row]);
    if (!slice.exists) slice.a = slice.b = SliceEnd(0.0, 1.0);  // covers nothing
    uint facing = draws[corners.w].facing;
    bool both = (facing & FACING_BOTH) != 0u;
    // The eye that sees the triangle densest tells best which end is left where it is faced.
    Plane plane = triangle_plane(a, b, c);
    float eye = densest_eye_columns(plane);
    bool rightward = column_from(slice.a, eye) <= column_from(slice.b, eye);
    if (rightward != faces(facing, eye_side(plane, eye * frame.column_mm))) {
        SliceEnd end = slice.a; slice.a = slice.b; slice.b = end;
    }
    float y_mm = row_centre_mm(row), offset = row_offsets[row];
    float a_mm = (column_from(slice.a, eye) - offset) * frame.column_mm;
    float b_mm = (column_from(slice.b, eye) - offset) * frame.column_mm;
    point_rows[place] = PointRow(slice.a.at_centre, slice.a.k, slice.b.at_centre, slice.b.k,
                                 plane_k(plane, eye * frame.column_mm, a_mm, y_mm), plane_k(plane, eye * frame.column_mm, b_mm, y_mm),
                                 seen.triangle, uint(row) | (both ? DOUBLE_SIDED : 0u));
}

// A triangle's row of points, found from the triangle and the window row.
// Needs: the batch, RowOffsets.

#include "common/triangles.glsl"
#include "common/shear.glsl"
#include "common/plane.glsl"
#include "layout/PointRow"

// How many columns a view sees of a slice at most, at least one. Its length is linear in the eye; a hundredth is more
// than rounding makes of it.
uint most_columns(Slice slice) {
    float first = abs(column_from(slice.a, frame.eye_first) - column_from(slice.b, frame.eye_first));
    float last = abs(column_from(slice.a, frame.eye_last) - column_from(slice.b, frame.eye_last));
    return uint(min(max(first, last) + 0.01, float(frame.columns - 1))) + 1u;
}

PointRow point_row(uint triangle, int row) {
    uvec4 corners = corners_of(triangle);
    vec3 a = position_of(corners.x);
    vec3 b = position_of(corners.y);
    vec3 c = position_of(corners.z);
    Slice slice = slice_triangle(a, b, c, row, row_offsets[row]);
    if (!slice.exists) slice.a = slice.b = SliceEnd(0.0, 1.0);  // covers nothing
    uint facing = draw_facing(corners.w);
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
    return PointRow(slice.a.at_centre, slice.a.k, slice.b.at_centre, slice.b.k,
                    plane_k(plane, eye * frame.column_mm, a_mm, y_mm), plane_k(plane, eye * frame.column_mm, b_mm, y_mm),
                    triangle, uint(row) | (both ? DOUBLE_SIDED : 0u) | most_columns(slice) << COLUMNS_SHIFT);
}

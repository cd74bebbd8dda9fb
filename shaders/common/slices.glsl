// A row of points as the slice between its ends.

#include "common/shear.glsl"
#include "layout/PointRow"

Slice slice_of(PointRow points) {
    return Slice(SliceEnd(points.a_column, points.a_k), SliceEnd(points.b_column, points.b_k), true);
}

int row_of(PointRow points) {
    return int(points.row_sides & 0xFFFFu);
}

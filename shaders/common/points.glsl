// A row of points, read back.

#include "common/shear.glsl"
#include "common/plane.glsl"
#include "layout/PointRow"
#include "layout/Work"

layout(std430) readonly restrict buffer PointRows { PointRow point_rows[]; };
layout(std430) readonly restrict buffer WorkBlock { Work work[]; };

uniform int window;

Slice row_slice(PointRow points) {
    return Slice(SliceEnd(points.a_column, points.a_toward), SliceEnd(points.b_column, points.b_toward), true);
}

Plane row_plane(PointRow points) {
    return Plane(vec3(points.normal_x, points.normal_y, points.normal_z), points.at_centre,
                 vec2(points.depth_near, points.depth_far));
}

// First and end index of the cells that a row's slice touches, in the densest view.
ivec2 row_cells(PointRow points, Slice slice) {
    float from = column_from(slice.a, points.densest_eye), to = column_from(slice.b, points.densest_eye);
    int first = int(floor(from / points.cell));
    return ivec2(first, max(first + 1, int(ceil(to / points.cell))));
}

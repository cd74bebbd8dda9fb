// How many points the rows of a window hold. Run only when someone asks; one thread a row.
// In: the batch, Spans, PointRows, Work. Out: PointCount.

layout(local_size_x = 64) in;

#include "common/triangles.glsl"
#include "common/points.glsl"
#include "common/plane.glsl"
#include "layout/Span"

layout(std430) readonly restrict buffer Spans { Span spans[]; };
layout(std430) restrict buffer PointCount { uint point_count; };

void main() {
    uint place = (gl_WorkGroupID.y * GROUPS_ACROSS + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
    if (place >= work[window].items) return;
    PointRow points = point_rows[place];
    Slice slice = slice_of(points);
    if (slice.a == slice.b) return;
    uvec4 corners = corners_of(points.triangle);
    Plane plane = triangle_plane(position_of(corners.x), position_of(corners.y),
                                 position_of(corners.z));
    float eye = densest_eye_columns(plane), cell = spans[points.triangle].point_columns;
    float p = column_from(slice.a, eye), q = column_from(slice.b, eye);
    int first = int(floor(min(p, q) / cell)), end = int(ceil(max(p, q) / cell));
    atomicAdd(point_count, uint(max(1, end - first)));
}

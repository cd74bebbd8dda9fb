// How many points the splatter enumerates: cells of the densest eye's columns that each slice touches.
// Run only when someone asks. One thread a group of items.
// In: the batch, the points. Out: PointCount.

layout(local_size_x = 1) in;

#include "common/triangles.glsl"
#include "common/shear.glsl"
#include "common/plane.glsl"
#include "splat/items.glsl"

layout(std430) readonly restrict buffer RowOffsets { float row_offsets[]; };
layout(std430) restrict buffer PointCount { uint point_count; };

uint points_on_row(vec3 a, vec3 b, vec3 c, int row, float densest_eye, float cell) {
    Slice slice = slice_triangle(a, b, c, row, row_offsets[row]);
    if (!slice.exists) return 0u;
    float p = column_from(slice.a, densest_eye), q = column_from(slice.b, densest_eye);
    return uint(max(1.0, ceil(max(p, q) / cell) - floor(min(p, q) / cell)));
}

void main() {
    if (gl_WorkGroupID.z > 0u) return;  // one per block of views
    uint item = first_item(), end = min(item + GROUP_ITEMS, work.items), points = 0u;
    for (uint v = visible_at(item); item < end; v++) {
        uint triangle = visible[v].triangle;
        uint last = min(end, v + 1u < work.visible ? visible[v + 1u].first_item : work.items);
        uvec4 corners = triangles[triangle];
        vec3 a = display_positions[corners.x].xyz;
        vec3 b = display_positions[corners.y].xyz;
        vec3 c = display_positions[corners.z].xyz;
        Span span = spans[triangle];
        float densest_eye = densest_eye_columns(triangle_plane(a, b, c));
        for (int row = int((span.rows & 0xFFFFu) + item - visible[v].first_item); item < last; item++, row++)
            points += points_on_row(a, b, c, row, densest_eye, span.point_columns);
    }
    atomicAdd(point_count, points);
}

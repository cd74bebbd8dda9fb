// Items, rows of visible triangles, and the points on each: cells of the densest eye's columns. Points
// are enumerated from their row and never stored.

#include "common/triangles.glsl"
#include "common/shear.glsl"
#include "common/plane.glsl"
#include "layout/Span"
#include "layout/Visible"
#include "layout/Work"

layout(std430) readonly restrict buffer Spans { Span spans[]; };
layout(std430) readonly restrict buffer VisibleTriangles { Visible visible[]; };
layout(std430) readonly restrict buffer WorkBlock { Work work; };
layout(std430) readonly restrict buffer RowOffsets { float row_offsets[]; };

struct PointRow {
    Slice slice;       // from left to right in the densest view
    Plane plane;
    float from;        // its ends there, in columns
    float to;
    float cell;        // length of a point, in columns
    float densest_eye; // in columns
    uint triangle;     // within the batch
    uint facing;
    int row;
};

uint first_item() {
    return (gl_WorkGroupID.y * GROUPS_ACROSS + gl_WorkGroupID.x) * GROUP_ITEMS;
}

// Index of the visible triangle that holds an item: the last one that starts at or before it.
uint visible_at(uint item) {
    uint low = 0u, high = work.visible;
    while (low + 1u < high) {
        uint middle = (low + high) / 2u;
        if (visible[middle].first_item <= item) low = middle;
        else high = middle;
    }
    return low;
}

PointRow point_row(uint item) {
    Visible seen = visible[visible_at(item)];
    uvec4 corners = triangles[seen.triangle];
    vec3 a = display_positions[corners.x].xyz;
    vec3 b = display_positions[corners.y].xyz;
    vec3 c = display_positions[corners.z].xyz;
    Span span = spans[seen.triangle];

    PointRow points;
    points.triangle = seen.triangle;
    points.facing = draws[corners.w].facing;
    points.row = int((span.rows & 0xFFFFu) + item - seen.first_item);
    points.cell = span.point_columns;
    points.plane = triangle_plane(a, b, c);
    points.densest_eye = densest_eye_columns(points.plane);
    points.slice = slice_triangle(a, b, c, points.row, row_offsets[points.row]);
    points.from = column_from(points.slice.a, points.densest_eye);
    points.to = column_from(points.slice.b, points.densest_eye);
    if (points.from > points.to) {
        SliceEnd end = points.slice.a; points.slice.a = points.slice.b; points.slice.b = end;
        float column = points.from; points.from = points.to; points.to = column;
    }
    return points;
}

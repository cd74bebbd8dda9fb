// The point that owns a pixel, of either lattice: its size, and where its centre lies. A point owns its
// half-open cell, so a pixel of a triangle belongs to one.
// Needs: the batch, RowOffsets.

#include "common/closest.glsl"
#include "common/surface.glsl"
#include "cells/lattice.glsl"
#include "sample/density.glsl"

// [triangle]: the steps of the paper's lattice in mm, or Span, whose second word is the length of the points
// of a row in columns.
layout(std430) readonly restrict buffer PointSizes { vec2 point_sizes[]; };

// Area of a point at some depth in pixels of the view that sees its triangle densest, which grow with the
// depth's cube, as points of rows do.
float densest_pixels_of(uint triangle, Plane plane, float depth) {
    vec2 size = point_sizes[triangle];
    float farther = depth / plane.depths.x;
    return PAPER_LATTICE == 0 ? size.y : size.x * size.y / (densest_pixel_mm2(plane) * farther * farther * farther);
}

// Centre of the cell of the paper's lattice that p lies in, or what of the triangle is closest to it.
vec3 cell_centre(vec3 p, vec3 a, vec3 b, vec3 c, Plane plane, vec2 step_mm) {
    Aligned t = align(a, b, c, plane);
    vec2 mm = vec2(dot(p - t.a, t.u), dot(p - t.a, t.v)) - t.low;
    return closest_on_triangle(display_from_lattice(t, (floor(mm / step_mm) + 0.5) * step_mm), a, b, c);
}

// Centre of the point of a window row that p lies in, kept within the triangle's slice.
vec3 row_point_centre(vec3 p, vec3 a, vec3 b, vec3 c, Plane plane, float columns, int row) {
    float eye = densest_eye_columns(plane), offset = row_offsets[row];
    Slice slice = slice_triangle(a, b, c, row, offset);
    if (!slice.exists) return p;
    float from = column_from(slice.a, eye), to = column_from(slice.b, eye);
    float centre = (floor(column_from(slice_end(p, offset), eye) / columns) + 0.5) * columns;
    float x_mm = (clamp(centre, min(from, to), max(from, to)) - offset) * frame.column_mm;
    return hit_triangle(a, b, c, plane, eye * frame.column_mm, x_mm, row_centre_mm(row)).p_display;
}

// Where a pixel of a triangle is shaded: where its ray hits, or at the centre of the point that owns it, as
// this eye sees that.
Hit shaded_hit(uint triangle, vec3 a, vec3 b, vec3 c, Plane plane, float eye_mm, int row, int column) {
    float x_mm = (float(column) + 0.5 - row_offsets[row]) * frame.column_mm;
    Hit hit = hit_triangle(a, b, c, plane, eye_mm, x_mm, row_centre_mm(row));
    if (SHADE_AT_POINT == 0) return hit;
    vec2 size = point_sizes[triangle];
    vec3 p = PAPER_LATTICE == 0 ? row_point_centre(hit.p_display, a, b, c, plane, size.y, row)
                                : cell_centre(hit.p_display, a, b, c, plane, size);
    if (depth_of(p) < frame.near_mm) return hit;
    float k = frame.distance_mm / depth_of(p);
    return hit_triangle(a, b, c, plane, eye_mm, k * p.x + (1.0 - k) * eye_mm, k * p.y);
}

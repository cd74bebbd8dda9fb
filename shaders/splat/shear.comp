// Splat points into all views by the shear identity. A lane is a view; a work group takes
// GROUP_ITEMS consecutive rows of visible triangles. On each row the triangle is a slice; its points
// are cells of the densest eye's columns, and a point's footprint in a view, cut to the triangle
// (the inside-triangle test of Gavane and Watson 2023, section 3.3), is an interval of columns whose
// ends move linearly with the eye.
// In: the batch, Spans, VisibleTriangles, Work, Eyes (columns), RowOffsets. Out: Depths or Words.

layout(local_size_x = VIEW_LANES) in;

#include "common/triangles.glsl"
#include "common/shear.glsl"
#include "common/plane.glsl"
#include "common/alpha.glsl"
#include "splat/visit.glsl"
#include "splat/items.glsl"

layout(std430) readonly restrict buffer RowOffsets { float row_offsets[]; };

struct Target {
    int view;
    float eye;     // of this lane, in columns
    float eye_mm;
    float side;    // of this lane's eye
};

void visit_columns(int first, int end, int row, Target target, Plane plane, uint triangle) {
    float y_mm = row_centre_mm(row);
    for (int column = max(first, 0); column < min(end, frame.columns); column++) {
        float x_mm = (float(column) + 0.5 - row_offsets[row]) * frame.column_mm;
        if (ALPHA_TESTED != 0 && !alpha_accepts(triangle, plane, target.eye_mm, x_mm, y_mm, ivec3(column, row, target.view)))
            continue;
        float depth = plane_depth(plane, target.side, target.eye_mm, x_mm, y_mm);
        visit(view_pixel(row, target.view, column), depth, frame.triangle_base + triangle);
    }
}

// First column whose centre is not left of a position: centres on a left edge are inside.
int column_cut(float column) {
    return int(ceil(clamp(column, -1e6, 1e6) - 0.5));
}

// The points of one slice: cell boundaries at multiples of `cell` columns of the densest eye.
void splat_slice(Slice slice, int row, float cell, float densest_eye, Target target, Plane plane, uint triangle) {
    float from = column_from(slice.a, densest_eye), to = column_from(slice.b, densest_eye);
    if (from > to) {
        SliceEnd end = slice.a; slice.a = slice.b; slice.b = end;
        float column = from; from = to; to = column;
    }
    int first_cell = int(floor(from / cell)), end_cell = int(ceil(to / cell));
    int cut = column_cut(column_from(slice.a, target.eye));
    int cut_last = column_cut(column_from(slice.b, target.eye));
    float toward_per_column = (slice.b.toward - slice.a.toward) / (to - from);
    for (int point = first_cell + 1; point < end_cell; point++) {
        float boundary = float(point) * cell;
        float toward = slice.a.toward + (boundary - from) * toward_per_column;
        int next = column_cut(boundary + toward * (target.eye - densest_eye));
        next = clamp(next, min(cut, cut_last), max(cut, cut_last));
        visit_columns(min(cut, next), max(cut, next), row, target, plane, triangle);
        cut = next;
    }
    visit_columns(min(cut, cut_last), max(cut, cut_last), row, target, plane, triangle);
}

void main() {
    Target target;
    target.view = int(gl_WorkGroupID.z * VIEW_LANES + gl_LocalInvocationID.x);
    if (target.view >= frame.views) return;
    target.eye = eyes[target.view];
    target.eye_mm = target.eye * frame.column_mm;

    uint item = first_item(), end = min(item + GROUP_ITEMS, work.items);
    for (uint v = visible_at(item); item < end; v++) {
        uint triangle = visible[v].triangle;
        uint last = min(end, v + 1u < work.visible ? visible[v + 1u].first_item : work.items);
        uvec4 corners = triangles[triangle];
        vec3 a = display_positions[corners.x].xyz;
        vec3 b = display_positions[corners.y].xyz;
        vec3 c = display_positions[corners.z].xyz;
        Plane plane = triangle_plane(a, b, c);
        target.side = eye_side(plane, target.eye_mm);
        float densest_eye = densest_eye_columns(plane);
        bool seen = faces(draws[corners.w].facing, target.side);
        Span span = spans[triangle];
        for (int row = int((span.rows & 0xFFFFu) + item - visible[v].first_item); item < last; item++, row++) {
            Slice slice = slice_triangle(a, b, c, row, row_offsets[row]);
            if (slice.exists && seen)
                splat_slice(slice, row, span.point_columns, densest_eye, target, plane, triangle);
        }
    }
}

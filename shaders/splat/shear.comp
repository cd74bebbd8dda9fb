// Splat points into all views by the shear identity. A work group takes GROUP_ITEMS consecutive items
// and prepares them together; then a lane is a view. A point's footprint in a view, cut to the triangle
// (the inside-triangle test of Gavane and Watson 2023, section 3.3), is an interval of columns whose
// ends move linearly with the eye.
// In: the batch, its points, Eyes (columns), RowOffsets. Out: Depths or Words.

layout(local_size_x = VIEW_LANES) in;

#include "splat/items.glsl"
#include "common/alpha.glsl"
#include "splat/visit.glsl"

layout(std430) readonly restrict buffer Eyes { float eyes[]; };  // in columns, view 0 first

shared PointRow items[GROUP_ITEMS];

// First column whose centre is not left of a position: centres on a left edge are inside.
int column_cut(float column) {
    return int(ceil(clamp(column, -1e6, 1e6) - 0.5));
}

void visit_columns(int first, int end, PointRow points, int view, float eye_mm) {
    float y_mm = row_centre_mm(points.row);
    float offset = row_offsets[points.row] - 0.5;
    for (int column = max(first, 0); column < min(end, frame.columns); column++) {
        float x_mm = (float(column) - offset) * frame.column_mm;
        if (ALPHA_TESTED != 0 && !alpha_accepts(points.triangle, points.plane, eye_mm, x_mm, y_mm, ivec3(column, points.row, view)))
            continue;
        float depth = plane_depth(points.plane, eye_mm, x_mm, y_mm);
        visit(view_pixel(points.row, view, column), depth, frame.triangle_base + points.triangle);
    }
}

// The points of a row, from cell boundary to cell boundary. In a boundary's own (densest) view it lies
// at a multiple of the cell, and 1 − k is linear along the slice there; other views shear it.
void splat_row(PointRow points, int view, float eye, float eye_mm) {
    int cut = column_cut(column_from(points.slice.a, eye));
    int cut_last = column_cut(column_from(points.slice.b, eye));
    int low = min(cut, cut_last), high = max(cut, cut_last);
    float toward_per_column = (points.slice.b.toward - points.slice.a.toward) / (points.to - points.from);
    int end_cell = int(ceil(points.to / points.cell));
    for (int cell = int(floor(points.from / points.cell)) + 1; cell < end_cell; cell++) {
        float boundary = float(cell) * points.cell;
        float toward = points.slice.a.toward + (boundary - points.from) * toward_per_column;
        int next = clamp(column_cut(boundary + toward * (eye - points.densest_eye)), low, high);
        visit_columns(min(cut, next), max(cut, next), points, view, eye_mm);
        cut = next;
    }
    visit_columns(min(cut, cut_last), max(cut, cut_last), points, view, eye_mm);
}

void main() {
    uint first = first_item();
    uint count = min(GROUP_ITEMS, work.items - min(first, work.items));
    for (uint item = gl_LocalInvocationID.x; item < count; item += VIEW_LANES)
        items[item] = point_row(first + item);
    barrier();

    int view = int(gl_WorkGroupID.z * VIEW_LANES + gl_LocalInvocationID.x);
    if (view >= frame.views) return;
    float eye = eyes[view], eye_mm = eye * frame.column_mm;
    for (uint item = 0u; item < count; item++) {
        PointRow points = items[item];
        if (points.slice.exists && faces(points.facing, eye_side(points.plane, eye_mm)))
            splat_row(points, view, eye, eye_mm);
    }
}

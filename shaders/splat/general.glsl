// Splat points into views of any projection: the path for rigs that are not parallel, and the check on
// the shear identity. The footprint of a triangle's lattice row in a view is the
// box of the triangle's part between the row's upper and lower plane, and of the box's pixels those
// inside the triangle are kept (Gavane and Watson 2023, section 3.3), by 2D homogeneous edge functions
// (Olano and Greer 1997), so that nothing needs clipping.
// In: PointRows, Work, the batch, PixelMatrices (column·w, row·w, unused, w from display space; w is the
// depth), RowShifts. Out: Depths or Words.

#include "common/triangles.glsl"
#include "common/points.glsl"
#include "common/alpha.glsl"

layout(std430) readonly restrict buffer PixelMatrices { mat4 pixel_matrices[]; };
layout(std430) readonly restrict buffer RowShifts { int row_shifts[]; };  // matrix column − stored column
layout(std430) readonly restrict buffer Eyes { float eyes[]; };

// A convex polygon in display space: a triangle cut by up to three planes.
struct Polygon {
    vec3 points[6];
    int count;
};

// Signed distance, times a positive factor, from the planes of a lattice row and a view's near plane.
float inside(int plane, vec3 p, int row, mat4 pixel_from_display) {
    float half_row = 0.5 * frame.row_mm;
    if (plane == 0) return -above_row(p, row_centre_mm(row) + half_row);
    if (plane == 1) return above_row(p, row_centre_mm(row) - half_row);
    return (pixel_from_display * vec4(p, 1.0)).w - frame.near_mm;
}

// Sutherland and Hodgman 1974.
Polygon cut(Polygon polygon, int plane, int row, mat4 pixel_from_display) {
    Polygon kept;
    kept.count = 0;
    for (int i = 0; i < polygon.count; i++) {
        vec3 p = polygon.points[i], q = polygon.points[i + 1 < polygon.count ? i + 1 : 0];
        float at_p = inside(plane, p, row, pixel_from_display), at_q = inside(plane, q, row, pixel_from_display);
        if (at_p >= 0.0 && kept.count < 6) kept.points[kept.count++] = p;
        if ((at_p >= 0.0) != (at_q >= 0.0) && kept.count < 6) kept.points[kept.count++] = mix(p, q, at_p / (at_p - at_q));
    }
    return kept;
}

// Lowest and highest column and row of what a view sees of a triangle's part on a lattice row, with one
// pixel of margin for rounding; empty when low exceeds high.
ivec4 footprint_box(mat3 corners_display, int row, mat4 pixel_from_display) {
    Polygon polygon;
    polygon.count = 3;
    for (int i = 0; i < 3; i++) polygon.points[i] = corners_display[i];
    for (int plane = 0; plane < 3; plane++) polygon = cut(polygon, plane, row, pixel_from_display);
    vec2 low = vec2(1e6), high = vec2(-1e6);
    for (int i = 0; i < polygon.count; i++) {
        vec3 p = (pixel_from_display * vec4(polygon.points[i], 1.0)).xyw;
        low = min(low, p.xy / max(p.z, frame.near_mm));
        high = max(high, p.xy / max(p.z, frame.near_mm));
    }
    return ivec4(ivec2(floor(clamp(low, -1e6, 1e6))) - 1, ivec2(ceil(clamp(high, -1e6, 1e6))) + 1);
}

// Edge function of the edge p→q at the origin; exactly opposite for q→p.
float edge_function(vec2 p, vec2 q) {
    precise float value = p.x * q.y - p.y * q.x;
    return value;
}

// A centre exactly on an edge is inside when the inside lies to its right, or straight below: what the
// edge function does there when the centre moves that way.
bool owns(float value, vec3 p, vec3 q, float orientation) {
    if (value != 0.0) return value * orientation > 0.0;
    float right = (p.y * q.z - q.y * p.z) * orientation, down = (q.x * p.z - p.x * q.z) * orientation;
    return right > 0.0 || (right == 0.0 && down > 0.0);
}

void splat_row(PointRow points, int view) {
    uvec4 corners = corners_of(points.triangle);
    mat3 corners_display = mat3(position_of(corners.x), position_of(corners.y), position_of(corners.z));
    mat4 pixel_from_display = pixel_matrices[view];
    vec3 a = (pixel_from_display * vec4(corners_display[0], 1.0)).xyw;
    vec3 b = (pixel_from_display * vec4(corners_display[1], 1.0)).xyw;
    vec3 c = (pixel_from_display * vec4(corners_display[2], 1.0)).xyw;
    ivec4 box = footprint_box(corners_display, row_of(points), pixel_from_display);

    uint facing = draw_facing(corners.w);
    uint id = frame.triangle_base + points.triangle;
    int boxed = 0;
    for (int row = max(frame.band_first, box.y); row < min(frame.band_first + frame.band_rows, box.w); row++) {
        int shift = row_shifts[row];
        boxed += max(min(frame.columns, box.z - shift) - max(0, box.x - shift), 0);
        for (int column = max(0, box.x - shift); column < min(frame.columns, box.z - shift); column++) {
            vec2 centre = vec2(float(column + shift), float(row)) + 0.5;
            precise vec2 pa = a.xy - centre * a.z, pb = b.xy - centre * b.z, pc = c.xy - centre * c.z;
            vec3 edges = vec3(edge_function(pb, pc), edge_function(pc, pa), edge_function(pa, pb));
            // Sum of the weights over the determinant is 1/w; rows run downward, which turns windings.
            float determinant = dot(edges, vec3(a.z, b.z, c.z));
            float orientation = sign(determinant);
            float depth = determinant / (edges.x + edges.y + edges.z);
            if (!faces(facing, -determinant) || !(depth >= frame.near_mm)) continue;
            if (!owns(edges.x, b, c, orientation) || !owns(edges.y, c, a, orientation) || !owns(edges.z, a, b, orientation)) continue;
            if (ALPHA_TESTED != 0 && !alpha_accepts(points.triangle, eyes[view], row, column)) continue;
            visit(view_pixel(row, view, column), depth, id);
        }
    }
    tried(uint(max(boxed, 1)));
}

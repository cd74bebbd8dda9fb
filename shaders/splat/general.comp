// Splat points into views of any projection: the path for rigs that are not parallel, and the check on
// the shear identity. A work group takes one lattice row of a triangle; its footprint in a view is the
// box of the triangle's part between the row's upper and lower plane, and of the box's pixels those
// inside the triangle are kept (Gavane and Watson 2023, section 3.3), by 2D homogeneous edge functions
// (Olano and Greer 1997), so that nothing needs clipping.
// In: PointRows, Work, the batch, PixelMatrices (column·w, row·w, unused, w from display space; w is the
// depth), RowShifts. Out: Depths or Words.

layout(local_size_x = VIEW_LANES) in;

#include "common/triangles.glsl"
#include "common/points.glsl"
#include "common/alpha.glsl"
#include "splat/visit.glsl"

layout(std430) readonly restrict buffer PixelMatrices { mat4 pixel_matrices[]; };
layout(std430) readonly restrict buffer RowShifts { int row_shifts[]; };  // matrix column − stored column
layout(std430) readonly restrict buffer Eyes { float eyes[]; };

struct Box {
    vec2 low;   // column, row
    vec2 high;
    bool unbounded;
};

void extend(inout Box box, vec3 homogeneous) {
    box.unbounded = box.unbounded || homogeneous.z < frame.near_mm;
    vec2 p = homogeneous.xy / max(homogeneous.z, frame.near_mm);
    box.low = min(box.low, p);
    box.high = max(box.high, p);
}

// The part of an edge between two planes, given the signed distances of its ends; it may be empty.
void extend_by_edge(inout Box box, vec3 p, vec3 q, vec2 below_upper, vec2 above_lower) {
    vec2 part = positive_part(below_upper.x, below_upper.y);
    vec2 other = positive_part(above_lower.x, above_lower.y);
    part = vec2(max(part.x, other.x), min(part.y, other.y));
    if (part.x > part.y) return;
    extend(box, mix(p, q, part.x));
    extend(box, mix(p, q, part.y));
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

void main() {
    uint place = gl_WorkGroupID.y * GROUPS_ACROSS + gl_WorkGroupID.x;
    int view = int(gl_WorkGroupID.z * VIEW_LANES + gl_LocalInvocationID.x);
    PointRow points = point_rows[place];
    if (place >= work[window].items || view >= frame.views) return;
    uvec4 corners = triangles[points.triangle];
    mat3 vertices_display = mat3(display_positions[corners.x].xyz, display_positions[corners.y].xyz, display_positions[corners.z].xyz);
    mat4 matrix = pixel_matrices[view];
    vec3 a = (matrix * vec4(vertices_display[0], 1.0)).xyw;
    vec3 b = (matrix * vec4(vertices_display[1], 1.0)).xyw;
    vec3 c = (matrix * vec4(vertices_display[2], 1.0)).xyw;

    float upper = row_centre_mm(int(points.row)) + 0.5 * frame.row_mm, lower = upper - frame.row_mm;
    vec3 below, above;
    for (int i = 0; i < 3; i++) {
        below[i] = -above_row(vertices_display[i], upper);
        above[i] = above_row(vertices_display[i], lower);
    }
    Box box = Box(vec2(1e30), vec2(-1e30), false);
    extend_by_edge(box, a, b, below.xy, above.xy);
    extend_by_edge(box, b, c, below.yz, above.yz);
    extend_by_edge(box, c, a, below.zx, above.zx);
    if (box.unbounded) box = Box(vec2(-1e30), vec2(1e30), true);

    Plane plane = row_plane(points);
    uint id = frame.triangle_base + points.triangle;
    float eye_mm = eyes[view] * frame.column_mm;
    int row_end = min(frame.band_first + frame.band_rows, int(min(ceil(box.high.y), 1e6)) + 1);
    for (int row = max(frame.band_first, int(max(floor(box.low.y), -1e6)) - 1); row < row_end; row++) {
        int shift = row_shifts[row];
        int end = min(frame.columns, int(min(ceil(box.high.x), 1e6)) + 1 - shift);
        for (int column = max(0, int(max(floor(box.low.x), -1e6)) - 1 - shift); column < end; column++) {
            vec2 centre = vec2(float(column + shift), float(row)) + 0.5;
            precise vec2 pa = a.xy - centre * a.z, pb = b.xy - centre * b.z, pc = c.xy - centre * c.z;
            vec3 edges = vec3(edge_function(pb, pc), edge_function(pc, pa), edge_function(pa, pb));
            // Sum of the weights over the determinant is 1/w; rows run downward, which turns windings.
            float determinant = dot(edges, vec3(a.z, b.z, c.z));
            float orientation = sign(determinant);
            float depth = determinant / (edges.x + edges.y + edges.z);
            if (!faces(points.facing, -determinant) || !(depth >= frame.near_mm)) continue;
            if (!owns(edges.x, b, c, orientation) || !owns(edges.y, c, a, orientation) || !owns(edges.z, a, b, orientation)) continue;
            if (ALPHA_TESTED != 0) {
                float x_mm = (float(column) + 0.5 - points.row_offset) * frame.column_mm;
                if (!alpha_accepts(points.triangle, plane, eye_mm, x_mm, row_centre_mm(row))) continue;
            }
            visit(view_pixel(row, view, column), depth, id);
        }
    }
}

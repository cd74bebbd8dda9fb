// How many tracks the triangles have that some pixel shows: for every row a group of views, so many groups that a pixel's
// footprint is about that of the group's middle view, in width and in how far it leans over a row.
// In: the batch, Spans. In, out: TriangleTracks (whether shown; then see tracks.glsl, but numbers of tracks for first tracks).

layout(local_size_x = 64) in;

#include "common/triangles.glsl"
#include "common/plane.glsl"
#include "layout/Span"

layout(std430) restrict buffer TriangleTracks { uvec2 triangle_tracks[]; };
layout(std430) readonly restrict buffer Spans { Span spans[]; };
layout(std430) readonly restrict buffer Eyes { float eyes[]; };

uniform int first_row;  // of the part of the band, and where it ends
uniform int end_row;

const float LEAST_DENSITY = 0.5;  // of a group's sparsest view over its densest
const float MOST_LEAN = 0.5;      // of a view's footprint over the middle view's, columns a row

// The first view that sees the other side than the first view does.
uint crossing_view(Plane plane) {
    int low = 0, high = frame.views - 1;
    bool first = eye_side(plane, eyes[0] * frame.column_mm) < 0.0;
    while (high - low > 1) {
        int middle = (low + high) / 2;
        if ((eye_side(plane, eyes[middle] * frame.column_mm) < 0.0) == first) low = middle;
        else high = middle;
    }
    return uint(high);
}

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= frame.triangles) return;
    if (triangle_tracks[index].x == 0u) return;

    uvec4 triangle = corners_of(index);
    Plane plane = triangle_plane(position_of(triangle.x), position_of(triangle.y),
                                 position_of(triangle.z));
    float first = eye_side(plane, frame.eye_first * frame.column_mm);
    float last = eye_side(plane, frame.eye_last * frame.column_mm);
    bool turns = (first < 0.0) != (last < 0.0), both = (draw_facing(triangle.w) & FACING_BOTH) != 0u;
    uint rows = spans[index].rows, groups = 2u;
    int from = max(int(rows & 0xFFFFu), first_row), to = min(int((rows & 0xFFFFu) + (rows >> 16)), end_row);
    uint word = uint(from);
    if (turns && both) {
        word |= BOTH_SIDES | crossing_view(plane) << 21;
    } else {
        // A single-sided one that turns away is seen ever less dense up to where it does.
        float most = max(abs(first), abs(last)), least = turns ? 0.0 : min(abs(first), abs(last));
        float by_density = LEAST_DENSITY / (1.0 - LEAST_DENSITY) * (most - least) / max(least, 1e-6 * most);
        float lean = (frame.eye_last - frame.eye_first) * abs(plane.normal.y) * frame.row_mm / max(most + least, 1e-30);
        groups = uint(clamp(ceil(max(by_density, lean / MOST_LEAN)), 1.0, min(float(MOST_GROUPS), float(frame.views))));
    }
    triangle_tracks[index] = uvec2(word | (groups - 1u) << 16, uint(max(to - from, 0)) * groups);
}

// Where tracks that are shown are shaded: at places in even steps from end to end of the slice, as the middle view has
// it, or at its middle alone if it is short. One thread a track of the list.
// In: the batch, Shown, TriangleTracks, TrackList, TrackWork, Eyes, RowOffsets. In, out: SharedWork. Out: Tracks, Cells (triangle, row | view << 16,
// column).

layout(local_size_x = 64) in;

#include "common/triangles.glsl"
#include "common/shear.glsl"
#include "share/tracks.glsl"
#include "layout/Track"
#include "layout/SharedWork"
#include "layout/TrackWork"

layout(std430) readonly restrict buffer Shown { uint shown[]; };
layout(std430) readonly restrict buffer TrackList { uint track_list[]; };
layout(std430) readonly restrict buffer TrackWorkBlock { TrackWork track_work; };
layout(std430) readonly restrict buffer Eyes { float eyes[]; };
layout(std430) readonly restrict buffer RowOffsets { float row_offsets[]; };
layout(std430) writeonly restrict buffer Tracks { Track tracks[]; };
layout(std430) writeonly restrict buffer Cells { uvec4 cells[]; };
layout(std430) restrict buffer SharedWorkBlock { SharedWork shared_work; };

const float SHORT = 0.4;  // columns
const float STEPS_PER_COLUMN = 2.0;

shared uint group_cells, group_first;

void main() {
    uint listed = (gl_WorkGroupID.y * GROUPS_ACROSS + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
    bool any_here = listed < track_work.tracks;
    uint track = any_here ? track_list[listed] : 0u, triangle = any_here ? shown[track] - 1u : 0u;
    uint steps = 0u, count = 0u, row = 0u, view = 0u;
    float from = 0.0, to = 0.0;
    if (any_here) {
        uvec2 tracks_here = tracks_of(triangle);
        uint place = track - tracks_here.y, rows = quotient(place, groups_of(tracks_here));
        row = first_row_of(tracks_here) + rows;
        view = middle_of(tracks_here, place - rows * groups_of(tracks_here));
        uvec4 corners = corners_of(triangle);
        vec3 p = position_of(corners.x), q = position_of(corners.y), r = position_of(corners.z);
        float eye = eyes[view], offset = row_offsets[row];
        Slice slice = slice_triangle(p, q, r, int(row), offset);
        // Where rounding sees none, a pixel of the middle of the triangle tells of all.
        if (!slice.exists) slice.a = slice.b = slice_end((p + q + r) / 3.0, offset);
        float a = column_from(slice.a, eye), b = column_from(slice.b, eye);
        from = min(a, b), to = max(a, b);
        steps = to - from < SHORT ? 0u : uint(min(ceil(STEPS_PER_COLUMN * (to - from)), float(MOST_STEPS)));
        count = steps + 1u;
    }
    if (gl_LocalInvocationID.x == 0u) group_cells = 0u;
    barrier();
    uint place = atomicAdd(group_cells, count);
    barrier();
    if (gl_LocalInvocationID.x == 0u) {
        group_first = atomicAdd(shared_work.cells, group_cells);
        atomicMax(shared_work.most_cells, group_first + group_cells);
        uint groups = (min(group_first + group_cells, cells.length()) + 63u) / 64u;
        atomicMax(shared_work.groups_x, min(groups, GROUPS_ACROSS));
        atomicMax(shared_work.groups_y, (groups + GROUPS_ACROSS - 1u) / GROUPS_ACROSS);
    }
    barrier();
    if (!any_here) return;
    place += group_first;
    bool one = steps == 0u;
    float step = one ? 0.0 : (to - from) / float(steps);
    float between = (eyes[view] - frame.eye_first) / max(frame.eye_last - frame.eye_first, 1e-30);
    uint eye_word = uint(clamp(between, 0.0, 1.0) * float((1u << STEPS_SHIFT) - 1u) + 0.5);
    tracks[track] = Track(place, one ? 0.5 * (from + to) : from, one ? 0.0 : 1.0 / step, eye_word | steps << STEPS_SHIFT);
    for (uint i = 0u; i < count; i++) {
        if (place + i >= cells.length()) return;
        float column = one ? 0.5 * (from + to) : i == steps ? to : from + float(i) * step;
        cells[place + i] = uvec4(triangle, row | view << 16, floatBitsToUint(column), 0u);
    }
}

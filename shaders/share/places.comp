// Where tracks that are shown are shaded: at places in even steps from end to end of the slice, as the middle view has
// it, or at its middle alone if it is short. One thread a track.
// In: the batch, Shown, TrackTotal, Eyes, RowOffsets. In, out: SharedWork. Out: Tracks, Cells (triangle, row | view << 16,
// column).

layout(local_size_x = 64) in;

#include "common/triangles.glsl"
#include "common/shear.glsl"
#include "layout/Track"
#include "layout/SharedWork"

layout(std430) readonly restrict buffer Shown { uvec2 shown[]; };
layout(std430) readonly restrict buffer TrackTotal { uint track_total[]; };
layout(std430) readonly restrict buffer Eyes { float eyes[]; };
layout(std430) readonly restrict buffer RowOffsets { float row_offsets[]; };
layout(std430) writeonly restrict buffer Tracks { Track tracks[]; };
layout(std430) writeonly restrict buffer Cells { uvec4 cells[]; };
layout(std430) restrict buffer SharedWorkBlock { SharedWork shared_work; };

uniform uint groups_across;

const float SHORT = 0.3;  // columns
const float STEPS_PER_COLUMN = 2.0;

shared uint group_cells, group_first;

void main() {
    uint track = (gl_WorkGroupID.y * groups_across + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
    uvec2 what = track < min(track_total[0], shown.length()) ? shown[track] : uvec2(0u);
    uint steps = 0u, count = 0u;
    float from = 0.0, to = 0.0;
    if (what.x != 0u) {
        uvec4 corners = triangles[what.x - 1u];
        int row = int(what.y & 0xFFFFu);
        float eye = eyes[what.y >> 16];
        Slice slice = slice_triangle(display_positions[corners.x].xyz, display_positions[corners.y].xyz,
                                     display_positions[corners.z].xyz, row, row_offsets[row]);
        // Where rounding sees none, a pixel of the middle of the triangle tells of all.
        if (!slice.exists) slice.a = slice.b = slice_end((display_positions[corners.x].xyz + display_positions[corners.y].xyz + display_positions[corners.z].xyz) / 3.0, row_offsets[row]);
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
    }
    barrier();
    if (what.x == 0u) return;
    place += group_first;
    bool one = steps == 0u;
    float step = one ? 0.0 : (to - from) / float(steps);
    tracks[track] = Track(place, one ? 0.5 * (from + to) : from, one ? 0.0 : 1.0 / step, what.y >> 16 | steps << STEPS_SHIFT);
    for (uint i = 0u; i < count; i++) {
        if (place + i >= cells.length()) return;
        float column = one ? 0.5 * (from + to) : i == steps ? to : from + float(i) * step;
        cells[place + i] = uvec4(what.x - 1u, what.y, floatBitsToUint(column), 0u);
    }
}

// Lists the tracks that are shown, for most are not, and a software device works on what it leaves out. A work group looks
// through GROUP_TRACKS tracks. The order of the list varies; what it leads to does not.
// In: Shown, TrackTotal. In, out: TrackWork. Out: TrackList.

layout(local_size_x = 64) in;

#include "layout/TrackWork"

layout(std430) readonly restrict buffer Shown { uint shown[]; };
layout(std430) readonly restrict buffer TrackTotal { uint track_total[]; };
layout(std430) writeonly restrict buffer TrackList { uint track_list[]; };
layout(std430) restrict buffer TrackWorkBlock { TrackWork track_work; };

shared uint group_tracks, group_first;

void main() {
    const uint EACH = GROUP_TRACKS / 64u;  // beside each other, as what follows from the list goes along triangles
    uint thread = gl_LocalInvocationID.x, group = gl_WorkGroupID.y * GROUPS_ACROSS + gl_WorkGroupID.x;
    uint first = group * GROUP_TRACKS + EACH * thread, end = min(track_total[0], shown.length()), those = 0u;
    if (thread == 0u) group_tracks = 0u;
    for (uint i = 0u; i < EACH; i++) those |= uint(first + i < end && shown[first + i] != 0u) << i;
    barrier();
    uint place = atomicAdd(group_tracks, uint(bitCount(those)));
    barrier();
    if (thread == 0u) {
        group_first = atomicAdd(track_work.tracks, group_tracks);
        uint groups = (group_first + group_tracks + 63u) / 64u;
        atomicMax(track_work.groups_x, min(groups, GROUPS_ACROSS));
        atomicMax(track_work.groups_y, (groups + GROUPS_ACROSS - 1u) / GROUPS_ACROSS);
    }
    barrier();
    place += group_first;
    for (uint i = 0u; i < EACH; i++)
        if ((those >> i & 1u) != 0u) track_list[place++] = first + i;
}

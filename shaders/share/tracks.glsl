// Slice tracks: what a window row cuts from a triangle, over a group of views that see it about alike. What of a
// surface's light does not depend on the eye is found once a track, at places along the slice, and shared.
//
// TriangleTracks has two words a triangle: its first row | (groups − 1) << 16 | whether views see both its sides, then the groups
// are the views before and from `crossing` << 21 on; and its first track. They go by rows, then groups.

uniform usamplerBuffer TriangleTracks;  // of two triangles a texel

uvec2 tracks_of(uint triangle) {
    uvec4 two = texelFetch(TriangleTracks, int(triangle >> 1));
    return (triangle & 1u) == 0u ? two.xy : two.zw;
}

// n / d, rounded down, for n far below 2²⁴: software devices divide integers one by one.
uint quotient(uint n, uint d) {
    return uint((float(n) + 0.5) / float(d));
}

uint first_row_of(uvec2 tracks) {
    return tracks.x & 0xFFFFu;
}

uint groups_of(uvec2 tracks) {
    return (tracks.x >> 16 & 0xFu) + 1u;
}

uint group_of(uvec2 tracks, uint view) {
    if ((tracks.x & uint(BOTH_SIDES)) != 0u) return view < tracks.x >> 21 ? 0u : 1u;
    return quotient(view * groups_of(tracks), uint(frame.views));
}

// The middle view of a group.
uint middle_of(uvec2 tracks, uint group) {
    uint crossing = tracks.x >> 21, views = uint(frame.views), groups = groups_of(tracks);
    if ((tracks.x & uint(BOTH_SIDES)) != 0u) return (group == 0u ? crossing : crossing + views) / 2u;
    uint first = quotient(group * views + groups - 1u, groups), end = quotient((group + 1u) * views + groups - 1u, groups);
    return (first + end - 1u) / 2u;
}

uint track_of(uvec2 tracks, uint row, uint view) {
    return tracks.y + (row - first_row_of(tracks)) * groups_of(tracks) + group_of(tracks, view);
}

// Slice tracks: what a window row cuts from a triangle, over a group of views that see it about alike. What of a
// surface's light does not depend on the eye is found once a track, at places along the slice, and shared.
//
// A word tells of a triangle: its first row | groups << 16 | whether views see both its sides; then the groups are the
// views before and from `crossing` << 22 on.

#include "layout/Track"

layout(std430) restrict buffer TriangleTracks { uint triangle_tracks[]; };
layout(std430) restrict buffer TrackStarts { uint track_starts[]; };  // [triangle]: counts, then sums
layout(std430) readonly restrict buffer ViewGroups { uint view_groups[]; };  // [groups - 1][view]

const uint BOTH_SIDES = 1u << 21;

uint groups_of(uint word) {
    return word >> 16 & 0x1Fu;
}

// The group of a view: its number | its middle view << 5.
uint group_of(uint word, int view) {
    if ((word & BOTH_SIDES) == 0u) return view_groups[(groups_of(word) - 1u) * uint(frame.views) + uint(view)];
    uint crossing = word >> 22;
    return uint(view) < crossing ? (crossing / 2u) << 5 : 1u | (crossing + uint(frame.views)) / 2u << 5;
}

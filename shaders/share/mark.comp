// Which tracks pixels show; one thread a pixel of the listed blocks. The pixel's word becomes its track's.
// In: Blocks, TriangleTracks, TrackStarts, ViewGroups. In, out: Words. Out: Shown (triangle + 1, row | middle view << 16).

#define WORDS_WRITTEN
layout(local_size_x = BLOCK, local_size_y = GROUP_BLOCKS) in;

#include "common/frame.glsl"
#include "shade/visible.glsl"
#include "share/tracks.glsl"

layout(std430) writeonly restrict buffer Shown { uvec2 shown[]; };

void main() {
    Visible seen = visible_pixel();
    if (seen.nothing) return;
    uint row = uint(frame.band_first + seen.pixel.y), word = triangle_tracks[seen.triangle], group = group_of(word, seen.pixel.z);
    uint track = track_starts[seen.triangle] + (row - (word & 0xFFFFu)) * groups_of(word) + (group & 0x1Fu);
    words[WORD_STRIDE * band_pixel(seen.pixel)] = track | TRACK_WORD;
    if (track < shown.length()) shown[track] = uvec2(seen.triangle + 1u, row | (group >> 5) << 16);  // the same from all its pixels
}

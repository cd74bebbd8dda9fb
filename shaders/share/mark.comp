// Which tracks pixels show. A pixel's word names its track from here on, not its triangle.
// In: Blocks, TriangleTracks. In, out: Words. Out: Shown (triangle + 1).

layout(local_size_x = BLOCK, local_size_y = BLOCKS_ABREAST) in;

#include "common/frame.glsl"
#include "shade/visible.glsl"
#include "share/tracks.glsl"

layout(std430) writeonly restrict buffer Shown { uint shown[]; };

uniform uint first_track;  // what words of this batch's tracks are counted from

void mark_pixel(Visible seen) {
    if (seen.nothing) return;
    uint track = track_of(tracks_of(seen.triangle), uint(frame.band_first + seen.pixel.y), uint(seen.pixel.z));
    words[WORD_STRIDE * band_pixel(seen.pixel)] = first_track + track;
    if (track >= shown.length()) return;  // the frame is rendered again, with more room
    shown[track] = seen.triangle + 1u;  // the same from all its pixels
}

void main() {
    uvec2 places = own_places();
    for (uint place = places.x; place < places.y; place += BLOCKS_ABREAST) mark_pixel(visible_pixel(place));
}

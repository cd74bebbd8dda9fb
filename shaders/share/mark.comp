// Which tracks pixels show; one thread a pixel of the listed blocks.
// In: Words, Blocks, TriangleTracks. Out: Shown (triangle + 1).

layout(local_size_x = BLOCK, local_size_y = BLOCKS_ABREAST) in;

#include "common/frame.glsl"
#include "shade/visible.glsl"
#include "share/tracks.glsl"

layout(std430) writeonly restrict buffer Shown { uint shown[]; };

void mark_pixel(Visible seen) {
    if (seen.nothing) return;
    uint track = track_of(tracks_of(seen.triangle), uint(frame.band_first + seen.pixel.y), uint(seen.pixel.z));
    if (track < shown.length()) shown[track] = seen.triangle + 1u;  // the same from all its pixels
}

void main() {
    uvec2 places = own_places();
    for (uint place = places.x; place < places.y; place += BLOCKS_ABREAST) mark_pixel(visible_pixel(place));
}

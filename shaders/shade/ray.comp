// Deferred shading of visible view pixels: the word of a pixel names a triangle, the pixel's ray meets
// it, and shading happens there. Each visible pixel is shaded once, whatever the number of points.
// In: Words [row][view][column], Blocks, the batch, Eyes, RowOffsets. Out: view_images [view, row,
// column], which already hold the background.

layout(local_size_x = BLOCK, local_size_y = BLOCKS_ABREAST) in;

#include "shade/images.glsl"
#include "shade/surface.glsl"
#include "shade/visible.glsl"

void shade_pixel(Visible seen) {
    if (seen.nothing) return;
    Surface surface = surface_at(seen.triangle, seen.pixel.z, frame.band_first + seen.pixel.y, seen.pixel.x);
    store(seen.pixel, shade(surface).rgb);
}

void main() {
    uvec2 places = own_places();
    for (uint place = places.x; place < places.y; place += BLOCKS_ABREAST) shade_pixel(visible_pixel(place));
}

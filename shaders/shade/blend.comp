// Shading of the nearest blended surface, over what the view images hold.
// In: Words of the blended batch's winners; otherwise as shade/ray.comp. In, out: view_images.

layout(local_size_x = BLOCK, local_size_y = BLOCKS_ABREAST) in;

#include "common/half.glsl"
#include "shade/surface.glsl"
#include "shade/visible.glsl"

layout(rgba16f, binding = 0) restrict uniform image2DArray view_images;

void blend_pixel(Visible seen) {
    if (seen.nothing) return;
    Surface surface = surface_at(seen.triangle, seen.pixel.z, frame.band_first + seen.pixel.y, seen.pixel.x);
    vec4 over = shade(surface);
    vec4 under = imageLoad(view_images, seen.pixel);
    imageStore(view_images, seen.pixel, vec4(nearest_half(mix(under.rgb, over.rgb, over.a)), 1.0));
}

void main() {
    uvec2 places = own_places();
    for (uint place = places.x; place < places.y; place += BLOCKS_ABREAST) blend_pixel(visible_pixel(place));
}

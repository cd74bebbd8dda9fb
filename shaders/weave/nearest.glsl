// Interleave views that follow the lenses: each subpixel takes its view's pixel at its lens.
// In: places, by places.frag; view_images [view, row of the band, column], linear light or codes.

#include "weave/rows.glsl"

uniform usampler2DArray places;
uniform sampler2DArray view_images;
uniform int first_row;  // view row of the images' row 0

vec4 woven(ivec2 px) {
    uvec2 place = texelFetch(places, ivec3(px, 0), 0).xy;
    int row = view_row(px.y) - first_row;
    int red = int(place.y & 0xFFFFu), green = red + (int(place.y << 8) >> 24), blue = red + (int(place.y) >> 24);
    return vec4(
        texelFetch(view_images, ivec3(red, row, int(place.x & 0x3FFu)), 0).r,
        texelFetch(view_images, ivec3(green, row, int(place.x >> 10 & 0x3FFu)), 0).g,
        texelFetch(view_images, ivec3(blue, row, int(place.x >> 20)), 0).b,
        1.0
    );
}

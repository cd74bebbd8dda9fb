// Weaving of nearest views that follow the lenses: each subpixel takes its view's pixel at its lens. A work group takes a
// panel row, a lane two of its pixels at a time: software devices pay for the start of every vector of lanes.
// In: places, by places.frag; view_images.
// Out: panel, the same, rows from first_panel_row on; row 0 is the panel's top row.

layout(local_size_x = LANES) in;

#include "weave/rows.glsl"
#include "weave/views.glsl"

layout(rgba32ui, binding = 1) readonly uniform uimage2DArray places;
layout(binding = 0) writeonly uniform image2DArray panel;
uniform int first_row;  // view row of the images' row 0
uniform int first_panel_row;

vec4 woven(uvec2 place, int row) {
    int red = int(place.y & 0xFFFFu), green = red + (int(place.y << 8) >> 24), blue = red + (int(place.y) >> 24);
    return vec4(
        view_pixel(ivec3(red, row, int(place.x & 0x3FFu))).r,
        view_pixel(ivec3(green, row, int(place.x >> 10 & 0x3FFu))).g,
        view_pixel(ivec3(blue, row, int(place.x >> 20))).b,
        1.0
    );
}

void main() {
    int y = first_panel_row + int(gl_WorkGroupID.x), row = view_row(y) - first_row;
    for (int x = 2 * int(gl_LocalInvocationID.x); x < PANEL_COLUMNS; x += 2 * LANES) {
        uvec4 two = imageLoad(places, ivec3(x / 2, y, 0));
        imageStore(panel, ivec3(x, y, 0), woven(two.xy, row));
        imageStore(panel, ivec3(x + 1, y, 0), woven(two.zw, row));  // beyond an odd row's end nowhere
    }
}

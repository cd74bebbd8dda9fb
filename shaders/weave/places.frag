// Which view and column each subpixel shows, where views follow the lenses: the same for all frames.
// In: tables of phases; row_table's last word: column of lens 0 in the panel row's view row.
// Out, of two panel pixels beside each other: a word of three views of ten bits; a word of red's column of 16 bits and, as
// signed bytes, how far green's and blue's lie from it.

#include "weave/phase.glsl"

layout(location = 0) out uvec4 places;

uvec2 place_of(ivec2 px) {
    int kind = cell_kind(px.x, PANEL_ROWS - 1 - px.y);
    int lens_0 = int(texelFetch(row_table, ivec2(px.y, 0), 0).w);
    uvec3 pixel = pixel_phase(px);
    uint views = 0u;
    ivec3 columns;
    for (int channel = 0; channel < 3; channel++) {
        uvec3 phase = add_phases(pixel, subpixel_phases[kind * 3 + channel]);
        views |= uint(nearest_view(phase)) << (10 * channel);
        columns[channel] = clamp(int(phase.x) + lens_0, 0, COLUMNS - 1);
    }
    uint apart = (uint(columns.y - columns.x) & 0xFFu) << 16 | (uint(columns.z - columns.x) & 0xFFu) << 24;
    return uvec2(views, uint(columns.x) | apart);
}

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy) * ivec2(2, 1);
    places = uvec4(place_of(px), place_of(ivec2(min(px.x + 1, PANEL_COLUMNS - 1), px.y)));
}

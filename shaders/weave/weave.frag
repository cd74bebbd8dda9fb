// Interleave views into the panel image: each subpixel takes its view's pixel at its lens.
// Phases come from tables in units of views: whole views and a 32-bit fraction of one, added with
// carry; PhaseTables.view_index_map adds the same words. Row 0 of the
// target is the panel's top row.
// In: column_table [x]: phase; row_table [y]: phase, column of lens 0 as float bits; view_images [view,
// row, column] in scene-linear light. Out: linear panel pixels.

#include "common/frame.glsl"

uniform usampler2D column_table;
uniform usampler2D row_table;
uniform sampler2DArray view_images;
uniform uvec2 subpixel_phases[3 * CELL_KINDS];  // [kind][channel], relative to the column's
uniform float columns_per_lens;
uniform ivec2 panel_px;

layout(location = 0) out vec4 panel;

// Kind of subpixel cell (CellPatternMode), y counted from the bottom.
int cell_kind(int x, int y) {
    if (PATTERN_MODE == 1) return (x ^ y) & 1;
    if (PATTERN_MODE == 2) return x & 1;
    if (PATTERN_MODE == 3) return (y + 2 * (x & 1)) & 3;
    if (PATTERN_MODE == 4) return y & 1;
    return 0;
}

// Sum of phases in views; x: whole views, signed; y: fraction of 2³².
uvec2 add_phases(uvec2 a, uvec2 b) {
    uint fraction = a.y + b.y;
    return uvec2(a.x + b.x + uint(fraction < a.y), fraction);
}

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    int row = min((2 * px.y + 1) * frame.rows / (2 * panel_px.y), frame.rows - 1) - frame.band_first;
    int kind = cell_kind(px.x, panel_px.y - 1 - px.y);
    uvec4 row_entry = texelFetch(row_table, ivec2(px.y, 0), 0);
    uvec2 pixel_phase = add_phases(texelFetch(column_table, ivec2(px.x, 0), 0).xy, row_entry.xy);
    float lens_0 = uintBitsToFloat(row_entry.z);
    vec4 result = vec4(0.0, 0.0, 0.0, 1.0);
    for (int channel = 0; channel < 3; channel++) {
        uvec2 phase = add_phases(pixel_phase, subpixel_phases[kind * 3 + channel]);
        // φ·views = whole + fraction; lens = ⌊φ⌋, and z = 1 − frac(φ) gives view ⌊z·views⌋.
        int whole = int(phase.x);
        int lens = int(floor((float(whole) + 0.5) / float(frame.views)));
        int slot = whole - lens * frame.views;
        int off_by = slot < 0 ? -1 : slot >= frame.views ? 1 : 0;  // float32 division of large numbers
        lens += off_by;
        slot -= off_by * frame.views;
        int view = min(frame.views - 1, frame.views - slot - (phase.y != 0u ? 1 : 0));

        float column = float(lens) * columns_per_lens + lens_0;
        int last = frame.columns - 1;
        if (LINEAR_COLUMNS == 0) {
            result[channel] = texelFetch(view_images, ivec3(clamp(int(floor(column)), 0, last), row, view), 0)[channel];
        } else {
            float from = floor(column - 0.5), weight = column - 0.5 - from;
            float left = texelFetch(view_images, ivec3(clamp(int(from), 0, last), row, view), 0)[channel];
            float right = texelFetch(view_images, ivec3(clamp(int(from) + 1, 0, last), row, view), 0)[channel];
            result[channel] = mix(left, right, weight);
        }
    }
    panel = result;
}

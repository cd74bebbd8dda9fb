// Interleave views through a Gaussian over view pixels, views or both (Gavane and Watson 2024, section 4), by a
// fixed set of samples. Samples outside rows and views do not count; some sample always does.
// In: tables of phases; row_samples [sample][y]: view row or NO_ROW, base and offset (float bits) of
// weave/columns.glsl, the sample's columns included; view_images. Out: panel pixels.

#include "weave/phase.glsl"
#include "weave/columns.glsl"
#include "weave/views.glsl"

uniform usampler2D row_samples;
uniform int first_row;
uniform uvec2 view_offsets[SAMPLES];  // whole views, signed, and a fraction of 2³²

layout(location = 0) out vec4 panel;

// View that lies so far to the right of a phase, which counts views to the left, or to the right if INVERTED.
int offset_view(uvec3 phase, uvec2 offset) {
    if (INVERTED == 1) {
        uint sum = phase.z + offset.y;
        int view = int(phase.y) + int(offset.x) + int(sum < phase.z);
        return view - int(view == VIEWS && sum == 0u);
    }
    uint fraction = phase.z - offset.y;
    int slot = int(phase.y) - int(offset.x) - int(phase.z < offset.y);
    // At a phase of 0 exactly the last view ends.
    return VIEWS - slot - int(fraction != 0u || slot == 0);
}

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    int kind = cell_kind(px.x, PANEL_ROWS - 1 - px.y);
    uvec3 pixel = pixel_phase(px);
    uvec3 phases[3];
    for (int channel = 0; channel < 3; channel++) {
        phases[channel] = add_phases(pixel, subpixel_phases[kind * 3 + channel]);
    }
    vec3 total = vec3(0.0), weight = vec3(0.0);
    for (int n = 0; n < SAMPLES; n++) {
        uvec4 entry = texelFetch(row_samples, ivec2(px.y, n), 0);
        bool row_inside = entry.x != NO_ROW;
        int row = row_inside ? int(entry.x) - first_row : 0;
        for (int channel = 0; channel < 3; channel++) {
            int column = column_of(phases[channel], int(entry.y), uintBitsToFloat(entry.z)).whole;
            int view = offset_view(phases[channel], view_offsets[n]);
            bool inside = row_inside && uint(view) < uint(VIEWS);
            ivec3 place = ivec3(clamp(column, 0, COLUMNS - 1), row, clamp(view, 0, VIEWS - 1));
            total[channel] += inside ? view_pixel(place)[channel] : 0.0;
            weight[channel] += float(inside);
        }
    }
    panel = vec4(total / max(weight, 1.0), 1.0);
}

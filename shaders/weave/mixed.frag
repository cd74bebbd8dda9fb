// Interleave views, unfiltered: nearest or linear between two views, the lens's own column or linear between
// two columns.
// In: tables of phases; row_samples [0][y]: view row, base and offset (float bits) of weave/columns.glsl, half a
// column less; view_images. Out: panel pixels.

#include "weave/phase.glsl"
#include "weave/columns.glsl"
#include "weave/views.glsl"

uniform usampler2D row_samples;
uniform int first_row;

layout(location = 0) out vec4 panel;

float taken(int column, int row, int view, int channel) {
    return view_pixel(ivec3(clamp(column, 0, COLUMNS - 1), row, clamp(view, 0, VIEWS - 1)))[channel];
}

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    int kind = cell_kind(px.x, PANEL_ROWS - 1 - px.y);
    uvec4 entry = texelFetch(row_samples, ivec2(px.y, 0), 0);
    int row = int(entry.x) - first_row;
    uvec3 pixel = pixel_phase(px);
    vec4 result = vec4(1.0);
    for (int channel = 0; channel < 3; channel++) {
        uvec3 phase = add_phases(pixel, subpixel_phases[kind * 3 + channel]);
        Column column = column_of(phase, int(entry.y), uintBitsToFloat(entry.z));
        int view = nearest_view(phase);
        float between = 0.0;
        if (LINEAR_VIEWS == 1) {
            float at = view_coordinate(phase) - 0.5;
            view = int(floor(at));
            between = at - floor(at);
        }
        float value = taken(column.whole, row, view, channel);
        if (LINEAR_COLUMNS == 1) value = mix(value, taken(column.whole + 1, row, view, channel), column.part);
        if (LINEAR_VIEWS == 1) {
            float next = taken(column.whole, row, view + 1, channel);
            if (LINEAR_COLUMNS == 1) next = mix(next, taken(column.whole + 1, row, view + 1, channel), column.part);
            value = mix(value, next, between);
        }
        result[channel] = value;
    }
    panel = result;
}

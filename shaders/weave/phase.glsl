// Where subpixels lie under their lenses. Phases are whole lenses, whole views within a lens and a 32-bit
// fraction of a view, added with carries: the words that PhaseTables.view_index_map adds.
// In: column_table [x]: phase; row_table [y]: phase; correction_table [y][x]: phase, where CORRECTED is 1. Views
// run the other way under a lens where INVERTED is 1.

uniform usampler2D column_table;
uniform usampler2D row_table;
uniform usampler2D correction_table;
uniform uvec3 subpixel_phases[3 * CELL_KINDS];  // [kind][channel], relative to the column's

// Kind of subpixel cell (CellPatternMode), y counted from the bottom.
int cell_kind(int x, int y) {
    if (PATTERN_MODE == 1) return (x ^ y) & 1;
    if (PATTERN_MODE == 2) return x & 1;
    if (PATTERN_MODE == 3) return (y + 2 * (x & 1)) & 3;
    if (PATTERN_MODE == 4) return y & 1;
    return 0;
}

// Sum of phases: lens (signed), view within it, fraction of 2³².
uvec3 add_phases(uvec3 a, uvec3 b) {
    uint fraction = a.z + b.z;
    uint slot = a.y + b.y + uint(fraction < a.z);
    uint over = uint(slot >= uint(VIEWS));
    return uvec3(a.x + b.x + over, slot - over * uint(VIEWS), fraction);
}

uvec3 pixel_phase(ivec2 px) {
    uvec3 phase =
        add_phases(texelFetch(column_table, ivec2(px.x, 0), 0).xyz, texelFetch(row_table, ivec2(px.y, 0), 0).xyz);
    if (CORRECTED == 1) phase = add_phases(phase, texelFetch(correction_table, px, 0).xyz);
    return phase;
}

// z = 1 − frac φ gives view ⌊z·VIEWS⌋; at frac φ = 0 the last.
int nearest_view(uvec3 phase) {
    if (INVERTED == 1) return int(phase.y);
    return min(VIEWS - 1, VIEWS - int(phase.y) - int(phase.z != 0u));
}

// z·VIEWS, from 0 to VIEWS.
float view_coordinate(uvec3 phase) {
    float fraction = float(phase.z) / 4294967296.0;
    return INVERTED == 1 ? float(phase.y) + fraction : float(VIEWS - int(phase.y)) - fraction;
}

// frac φ.
float within_lens(uvec3 phase) {
    return (float(phase.y) + float(phase.z) / 4294967296.0) / float(VIEWS);
}

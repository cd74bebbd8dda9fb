// Columns of view images. A subpixel of lens k and place w within it (½: the lens centre) lies in a row at
//     COLUMNS_PER_LENS·k + base + COLUMNS_PER_LENS·w + offset   where views follow the lenses,
//     columns_per_lens·(k + w) + offset                         in upright views (COLUMNS_PER_LENS is 0).

uniform float columns_per_lens;

// Whole column, and the fraction where the place lies in it.
struct Column {
    int whole;
    float part;
};

Column column_of(uvec3 phase, int base, float offset) {
    float within = AT_LENS == 1 ? 0.5 : within_lens(phase);
    float at = columns_per_lens * (COLUMNS_PER_LENS > 0 ? within : float(int(phase.x)) + within) + offset;
    float whole = floor(at);
    return Column(int(whole) + COLUMNS_PER_LENS * int(phase.x) + base, at - whole);
}

// The band being rendered. Rows count from the top of the window; columns may be sheared by row
// (lens-aligned views), which every pass sees only through row_offset.

#include "layout/Frame"

layout(std140) uniform FrameBlock {
    Frame frame;
};

// Window y, in mm, of a row's centre.
float row_centre_mm(int row) {
    return 0.5 * frame.panel_height_mm - (float(row) + 0.5) * frame.row_mm;
}

// How far from the window columns are drawn, in columns: those of lenses that begin or end outside.
float margin_columns() {
    return max(2.0, float(frame.columns) - frame.panel_width_mm / frame.column_mm);
}

// Index of a view pixel in the view buffers, laid out [row of the band][view][column].
uint view_pixel(int row, int view, int column) {
    return uint(((row - frame.band_first) * frame.views + view) * frame.columns + column);
}

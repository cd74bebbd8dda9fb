// View row of a panel row, as whole numbers: ⌊(2·y + 1)·rows / (2·height)⌋, without an integer division,
// which software devices do lane by lane.

int view_row(int y) {
    int twice = (2 * y + 1) * VIEW_ROWS;
    int row = int((float(y) + 0.5) * (float(VIEW_ROWS) / float(PANEL_ROWS)));
    int rest = twice - row * (2 * PANEL_ROWS);
    return row + int(rest >= 2 * PANEL_ROWS) - int(rest < 0);
}

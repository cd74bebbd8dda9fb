// Points go to the end of a list whose order is that of the atomics; splatting does not depend on it.
// Points beyond the list's end are counted, so that the host enlarges it and repeats the frame.
// Out: Cells, CellWork.

#include "layout/Cell"
#include "layout/CellWork"

layout(std430) writeonly restrict buffer Cells { Cell cells[]; };
layout(std430) restrict buffer CellWorkBlock { CellWork cell_work; };

uniform uint room;  // cells of the list; zink of Mesa 22.3 misreads its length

// rows: on how many rows of the band some view may see the point; where on none, it is left out.
void append(uint triangle, uvec2 cell, int rows) {
    if (rows == 0) return;
    if (rows > STRIP_ROWS) atomicMax(cell_work.tallest, uint(rows));
    uint place = atomicAdd(cell_work.points, 1u);
    if (place < room) cells[place] = Cell(triangle, cell.x | cell.y << 16);
}

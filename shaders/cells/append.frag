// The paper's fragment stage: every cell that touches the triangle, and that some view may see, is appended.
// In: the batch. Out: Cells, CellWork.

#include "cells/lattice.glsl"
#include "cells/append.glsl"

flat in uint of_triangle;
flat in vec2 of_step_mm;

void main() {
    uvec4 corners = corners_of(of_triangle);
    vec3 a = position_of(corners.x);
    vec3 b = position_of(corners.y);
    vec3 c = position_of(corners.z);
    Aligned t = align(a, b, c, triangle_plane(a, b, c));
    ivec2 cell = ivec2(gl_FragCoord.xy);
    ivec2 touched = cells_touched(t, of_step_mm, cell.y);
    if (cell.x < touched.x || cell.x > touched.y) return;
    append(of_triangle, uvec2(cell), rows_ever_seen(t, of_step_mm, uvec2(cell)));
}

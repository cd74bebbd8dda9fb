// The points of a window of items: one thread a lattice row, which appends its cells that touch the
// triangle and that some view may see.
// In: the batch, Spans, VisibleTriangles, Work, LatticeSteps. Out: Cells, CellWork.

layout(local_size_x = 64) in;

#include "sample/items.glsl"
#include "cells/lattice.glsl"
#include "cells/append.glsl"

layout(std430) readonly restrict buffer LatticeSteps { vec2 lattice_steps_mm[]; };

void main() {
    uint place = (gl_WorkGroupID.y * GROUPS_ACROSS + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
    if (place >= work[window].items) return;
    uint item = work[window].first_item + place;
    Visible seen = visible[visible_at(item)];
    uvec4 corners = corners_of(seen.triangle);
    vec3 a = position_of(corners.x);
    vec3 b = position_of(corners.y);
    vec3 c = position_of(corners.z);
    Aligned t = align(a, b, c, triangle_plane(a, b, c));
    vec2 step_mm = lattice_steps_mm[seen.triangle];
    uint j = item - seen.first_item;
    ivec2 touched = cells_touched(t, step_mm, int(j));
    for (int i = touched.x; i <= touched.y; i++)
        append(seen.triangle, uvec2(i, j), rows_ever_seen(t, step_mm, uvec2(i, j)));
}

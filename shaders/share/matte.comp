// Shades the cells of tracks: what of their light all views of the group share.
// In: the batch, materials, SharedWork, Eyes, RowOffsets. In, out: Cells (see places.comp and packing.glsl).

layout(local_size_x = 64) in;

#include "shade/surface.glsl"
#include "share/packing.glsl"
#include "layout/SharedWork"

layout(std430) readonly restrict buffer SharedWorkBlock { SharedWork shared_work; };
layout(std430) restrict buffer Cells { uvec4 cells[]; };

// This work group's place in the list. A device in software gives each of its THREADS threads a run of a dispatch's work
// groups, and one end of the list is more work than the other: so threads take turns along it.
uint group_in_turn() {
    uint index = gl_WorkGroupID.y * GROUPS_ACROSS + gl_WorkGroupID.x;
    uint run = gl_NumWorkGroups.x * gl_NumWorkGroups.y / THREADS;
    if (THREADS == 1 || index >= run * THREADS) return index;
    uint thread = 0u;
    for (uint next = 1u; next < THREADS; next++) thread += uint(index >= next * run);
    return (index - thread * run) * THREADS + thread;
}

void main() {
    uint place = group_in_turn() * 64u + gl_LocalInvocationID.x;
    if (place >= min(shared_work.cells, cells.length())) return;
    uvec4 cell = cells[place];
    int row = int(cell.y & 0xFFFFu);
    float eye_mm = eyes[cell.y >> 16] * frame.column_mm;
    uvec4 corners = corners_of(cell.x);
    vec3 a = position_of(corners.x);
    vec3 b = position_of(corners.y);
    vec3 c = position_of(corners.z);
    Plane plane = triangle_plane(a, b, c);
    float x_mm = (uintBitsToFloat(cell.z) - row_offsets[row]) * frame.column_mm;
    Hit hit = hit_triangle(a, b, c, plane, eye_mm, x_mm, row_centre_mm(row));
    cells[place] = packed_matte(matte_of(surface_of(cell.x, eye_mm, plane, hit)));
}

// Shades the cells of tracks: what of their light all views of the group share.
// In: the batch, materials, SharedWork, Eyes, RowOffsets. In, out: Cells (see places.comp and packing.glsl).

layout(local_size_x = 64) in;

#include "shade/surface.glsl"
#include "share/packing.glsl"
#include "layout/SharedWork"

layout(std430) readonly restrict buffer SharedWorkBlock { SharedWork shared_work; };
layout(std430) restrict buffer Cells { uvec4 cells[]; };

void main() {
    uint place = (gl_WorkGroupID.y * GROUPS_ACROSS + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
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

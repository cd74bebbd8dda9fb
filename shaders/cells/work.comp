// What dispatches the splatter over the points just appended, and what the host must make room for.
// In, out: CellWork, CellNeeds.

layout(local_size_x = 1) in;

#include "layout/CellWork"
#include "layout/CellNeeds"

layout(std430) restrict buffer CellWorkBlock { CellWork cell_work; };
layout(std430) restrict buffer CellNeedsBlock { CellNeeds cell_needs; };

uniform uint room;  // points that the list holds
uniform uint view_blocks;

void main() {
    uint points = cell_work.points, groups = min(points, room);
    cell_work.splat_x = min(groups, GROUPS_ACROSS);
    cell_work.splat_y = (groups + GROUPS_ACROSS - 1u) / GROUPS_ACROSS;
    cell_work.splat_z = view_blocks;
    cell_needs.most_points = max(cell_needs.most_points, points);
    cell_needs.tallest = max(cell_needs.tallest, cell_work.tallest);
}

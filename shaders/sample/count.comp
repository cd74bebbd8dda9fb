// How many points the splatter enumerates: cells of the densest eye's columns that each slice touches.
// Run only when someone asks. One thread an item.
// In: the batch, its points. Out: PointCount.

layout(local_size_x = GROUP_ITEMS) in;

#include "splat/items.glsl"

layout(std430) restrict buffer PointCount { uint point_count; };

void main() {
    uint item = first_item() + gl_LocalInvocationID.x;
    if (gl_WorkGroupID.z > 0u || item >= work.items) return;  // z counts blocks of views
    PointRow points = point_row(item);
    if (!points.slice.exists) return;
    atomicAdd(point_count, uint(max(1.0, ceil(points.to / points.cell) - floor(points.from / points.cell))));
}

// Splat points by the shear identity; a work group owns a row of the band and a block of views, so that
// winners need no atomics. A dispatch takes at most BIN_ITEMS of each bin, because llvmpipe ends an
// invocation's loops after 65,535 iterations.
// In: PointRows, sorted by row; Bins (where each ends). Others and outputs: splat/shear.glsl,
// splat/visit_owned.glsl.

layout(local_size_x = VIEW_LANES) in;

#include "splat/visit_owned.glsl"
#include "splat/shear.glsl"

layout(std430) readonly restrict buffer Bins { uint bins[]; };

uniform uint taken;  // items of each bin that earlier dispatches took
uniform uint row_stride;  // coprime to the rows: llvmpipe gives each thread a run of work groups

void main() {
    uint bin = gl_WorkGroupID.x * row_stride % gl_NumWorkGroups.x;
    uint first = (bin == 0u ? 0u : bins[bin - 1u]) + taken;
    uint end = min(first + BIN_ITEMS, bins[bin]);
    int view = int(gl_WorkGroupID.y * VIEW_LANES + gl_LocalInvocationID.x);
    float eye = eyes[min(view, frame.views - 1)];
    for (uint place = first; place < end; place++) splat_row(point_rows[place], true, view, eye);
}

// Splat points by the shear identity; a work group owns a row of the band and a block of views, so that
// winners need no atomics. A lane takes up to three views. A dispatch takes at most BIN_ITEMS of each bin, because
// llvmpipe ends an invocation's loops after 65,535 iterations.
// In: binned_rows, sorted by row; Bins (where each ends). Others and outputs: splat/shear.glsl,
// splat/visit_owned.glsl.

#extension GL_ARB_gpu_shader_int64 : require

layout(local_size_x = VIEW_LANES) in;

#include "splat/visit_owned.glsl"
#include "splat/shear.glsl"

layout(std430) readonly restrict buffer Bins { uint bins[]; };

uniform usamplerBuffer binned_rows;  // two texels a PointRow

uniform uint taken;  // items of each bin that earlier dispatches took
uniform uint row_stride;  // coprime to the rows: llvmpipe gives each thread a run of work groups

PointRow binned_row(int place) {
    uvec4 ends = texelFetch(binned_rows, 2 * place), rest = texelFetch(binned_rows, 2 * place + 1);
    vec4 a_b = uintBitsToFloat(ends);
    vec2 depth_k = uintBitsToFloat(rest.xy);
    return PointRow(a_b.x, a_b.y, a_b.z, a_b.w, depth_k.x, depth_k.y, rest.z, rest.w);
}

void main() {
    uint bin = gl_WorkGroupID.x * row_stride % gl_NumWorkGroups.x;
    uint first = (bin == 0u ? 0u : bins[bin - 1u]) + taken;
    uint end = min(first + BIN_ITEMS, bins[bin]);
    int view = int(gl_WorkGroupID.y * VIEW_LANES * LANE_VIEWS + gl_LocalInvocationID.x);
    int second = view + int(VIEW_LANES), third = second + int(VIEW_LANES);
    float eye = eyes[min(view, frame.views - 1)];
    float second_eye = eyes[min(second, frame.views - 1)], third_eye = eyes[min(third, frame.views - 1)];
    for (uint place = first; place < end; place++) {
        PointRow points = binned_row(int(place));
        splat_row(points, true, view, eye);
        if (LANE_VIEWS > 1) splat_row(points, true, second, second_eye);
        if (LANE_VIEWS > 2) splat_row(points, true, third, third_eye);
    }
}

// Splat points by the shear identity; a work group owns a row of the band and a block of views, so that
// winners need no atomics. A lane takes up to three views. llvmpipe ends an invocation's loops after 65,535 iterations:
// where a bin takes more, the next round goes on, else it has nothing to do.
// In: binned_rows, sorted by row; Bins (where each ends). In, out: Progress; Rounds. Others and outputs:
// splat/shear.glsl, splat/visit_owned.glsl.

#extension GL_ARB_gpu_shader_int64 : require

layout(local_size_x = VIEW_LANES) in;

#include "splat/visit_owned.glsl"
#include "splat/shear.glsl"

layout(std430) readonly restrict buffer Bins { uint bins[]; };

uniform usamplerBuffer binned_rows;  // two texels a PointRow

layout(std430) restrict buffer Progress { uint progress[]; };  // items of its bin that each lane has taken
layout(std430) restrict buffer Rounds { uint rounds[]; };      // three words that dispatch each

uniform uint round_index;
uniform uint row_stride;  // coprime to the rows: llvmpipe gives each thread a run of work groups

PointRow binned_row(int place) {
    uvec4 ends = texelFetch(binned_rows, 2 * place), rest = texelFetch(binned_rows, 2 * place + 1);
    vec4 a_b = uintBitsToFloat(ends);
    vec2 depth_k = uintBitsToFloat(rest.xy);
    return PointRow(a_b.x, a_b.y, a_b.z, a_b.w, depth_k.x, depth_k.y, rest.z, rest.w);
}

void main() {
    uint bin = gl_WorkGroupID.x * row_stride % gl_NumWorkGroups.x;
    uint lane = (gl_WorkGroupID.y * gl_NumWorkGroups.x + bin) * VIEW_LANES + gl_LocalInvocationID.x;
    uint first = bin == 0u ? 0u : bins[bin - 1u], end = bins[bin], place = first + progress[lane];
    int view = int(gl_WorkGroupID.y * VIEW_LANES * LANE_VIEWS + gl_LocalInvocationID.x);
    int second = view + int(VIEW_LANES), third = second + int(VIEW_LANES);
    float eye = eyes[min(view, frame.views - 1)];
    float second_eye = eyes[min(second, frame.views - 1)], third_eye = eyes[min(third, frame.views - 1)];
    for (int spent = 0; place < end && spent <= MOST_SPENT; place++) {
        PointRow points = binned_row(int(place));
        splat_row(points, true, view, eye);
        if (LANE_VIEWS > 1) splat_row(points, true, second, second_eye);
        if (LANE_VIEWS > 2) splat_row(points, true, third, third_eye);
        spent += 1 + COLUMN_LOOPS * int(points.row_sides >> COLUMNS_SHIFT);
    }
    progress[lane] = place - first;
    if (place < end && gl_LocalInvocationID.x == 0u) atomicMax(rounds[3u * round_index + 3u], gl_NumWorkGroups.x);
}

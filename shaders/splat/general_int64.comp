// Splat points through each view's own matrix; winners by one pass of 64-bit atomics.
// Inputs and outputs: splat/general.glsl, splat/visit_int64.glsl.

#extension GL_ARB_gpu_shader_int64 : require
#extension GL_NV_shader_atomic_int64 : require

layout(local_size_x = VIEW_LANES) in;

#include "splat/visit_int64.glsl"
#include "splat/general_groups.glsl"

// Splat points through each view's own matrix; winners by two passes of 32-bit atomics.
// Inputs and outputs: splat/general.glsl, splat/visit.glsl.

layout(local_size_x = VIEW_LANES) in;

#include "splat/visit.glsl"
#include "splat/general_groups.glsl"

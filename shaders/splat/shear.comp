// Splat points by the shear identity; winners by two passes of 32-bit atomics.
// Inputs and outputs: splat/shear.glsl, splat/visit.glsl.

layout(local_size_x = VIEW_LANES) in;

#include "splat/visit.glsl"
#include "splat/groups.glsl"

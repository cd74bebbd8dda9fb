// Splat points of the paper's lattice; winners by two passes of 32-bit atomics.
// Inputs and outputs: splat/cells.glsl, splat/visit.glsl.

layout(local_size_x = VIEW_LANES) in;

#include "splat/visit.glsl"
#include "splat/each_cell.glsl"

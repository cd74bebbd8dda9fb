// The batch's triangles in display space.

#include "common/facing.glsl"
#include "layout/Draw"

layout(std430) readonly restrict buffer Triangles { uvec4 triangles[]; };  // vertices, draw
layout(std430) readonly restrict buffer DisplayPositions { vec4 display_positions[]; };
layout(std430) readonly restrict buffer Draws { Draw draws[]; };

// The batch's triangles in display space.

#include "layout/Draw"

layout(std430) readonly restrict buffer Triangles { uvec4 triangles[]; };  // vertices, draw
layout(std430) readonly restrict buffer DisplayPositions { vec4 display_positions[]; };
layout(std430) readonly restrict buffer Draws { Draw draws[]; };

// Whether an eye on this side of the plane sees the triangle.
bool faces(uint facing, float side) {
    if ((facing & FACING_BOTH) != 0u) return side != 0.0;
    return (facing & FACING_MIRRORED) != 0u ? side < 0.0 : side > 0.0;
}

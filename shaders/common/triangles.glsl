// The batch's triangles in display space.

#include "common/display.glsl"
#include "common/draws.glsl"
#include "common/facing.glsl"

uniform usamplerBuffer Triangles;

// Vertices, and the draw.
uvec4 corners_of(uint triangle) {
    return texelFetch(Triangles, int(triangle));
}

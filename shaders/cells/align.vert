// The paper's vertex stage: whether some view sees the vertex (only asked where VERTEX_CULLING is on).
// In: DisplayPositions.

#include "common/vertex_culling.glsl"

layout(std430) readonly restrict buffer DisplayPositions { vec4 display_positions[]; };

flat out uint vertex_seen_;

void main() {
    vertex_seen_ = uint(vertex_ever_seen(display_positions[gl_VertexID].xyz));
    gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
}

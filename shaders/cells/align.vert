// The paper's vertex stage: whether some view sees the vertex (only asked where VERTEX_CULLING is on).
// In: DisplayVertices.

#include "common/display.glsl"
#include "common/vertex_culling.glsl"

flat out uint vertex_seen_;

void main() {
    vertex_seen_ = uint(vertex_ever_seen(position_of(uint(gl_VertexID))));
    gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
}

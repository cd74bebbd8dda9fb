// Culling and the paper's lattice, one thread a triangle. A lattice row is an item.
// In: the batch, materials, Eyes. Out: Spans (0 | rows of the lattice << 16), LatticeSteps.

layout(local_size_x = 128) in;

layout(std430) readonly restrict buffer Eyes { float eyes[]; };

#include "sample/visible.glsl"
#include "common/vertex_culling.glsl"
#include "cells/density.glsl"
#include "layout/Span"

layout(std430) writeonly restrict buffer Spans { Span spans[]; };
layout(std430) writeonly restrict buffer LatticeSteps { vec2 lattice_steps_mm[]; };

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= frame.triangles) return;
    spans[index] = Span(0u, 1.0);

    uvec4 triangle = corners_of(index);
    vec3 a = position_of(triangle.x);
    vec3 b = position_of(triangle.y);
    vec3 c = position_of(triangle.z);
    Plane plane = triangle_plane(a, b, c);
    if (rows_seen(a, b, c, plane, draw_facing(triangle.w)).y == 0) return;
    if (VERTEX_CULLING != 0 && !vertices_ever_seen(a, b, c)) return;
    if (STOCHASTIC_CULLING != 0 && !stochastically_kept(frame.triangle_base + index, plane)) return;
    Aligned t = align(a, b, c, plane);
    vec2 step_mm = lattice_step_mm(triangle, a, b, c, plane, t);
    lattice_steps_mm[index] = step_mm;
    spans[index] = Span(uint(last_cell(t, step_mm).y + 1) << 16, 1.0);
}

// The paper's geometry stage: triangles that some view sees are laid level in the point-sampling view, one
// raster pixel a cell of their lattice. CONSERVATIVE: the driver's rasteriser reaches every pixel that a
// triangle touches; else the triangle's box is drawn and fragments outside the triangle are dropped.
// In: the batch, materials, Eyes. Out: LatticeSteps; the aligned triangle.

layout(triangles) in;
layout(triangle_strip, max_vertices = 4) out;

layout(std430) readonly restrict buffer Eyes { float eyes[]; };

#include "sample/visible.glsl"
#include "cells/density.glsl"

layout(std430) writeonly restrict buffer LatticeSteps { vec2 lattice_steps_mm[]; };

uniform uint first_triangle;  // of the draw

flat in uint vertex_seen_[];
flat out uint of_triangle;
flat out vec2 of_step_mm;

void emit(vec2 cell) {
    gl_Position = vec4(2.0 * cell / float(MOST_CELLS) - 1.0, 0.0, 1.0);
    EmitVertex();
}

void main() {
    uint index = first_triangle + uint(gl_PrimitiveIDIn);
    uvec4 triangle = corners_of(index);
    vec3 a = position_of(triangle.x);
    vec3 b = position_of(triangle.y);
    vec3 c = position_of(triangle.z);
    Plane plane = triangle_plane(a, b, c);
    if (rows_seen(a, b, c, plane, draw_facing(triangle.w)).y == 0) return;
    if (VERTEX_CULLING != 0 && (vertex_seen_[0] | vertex_seen_[1] | vertex_seen_[2]) == 0u) return;
    if (STOCHASTIC_CULLING != 0 && !stochastically_kept(frame.triangle_base + index, plane)) return;
    Aligned t = align(a, b, c, plane);
    vec2 step_mm = lattice_step_mm(triangle, a, b, c, plane, t);
    lattice_steps_mm[index] = step_mm;

    of_triangle = index;
    of_step_mm = step_mm;
    if (CONSERVATIVE != 0) {
        for (int i = 0; i < 3; i++) emit(t.corners[i] / step_mm);
    } else {
        vec2 cells = vec2(last_cell(t, step_mm) + 1);
        emit(vec2(0.0));
        emit(vec2(cells.x, 0.0));
        emit(vec2(0.0, cells.y));
        emit(cells);
    }
    EndPrimitive();
}

// Deferred shading of visible view pixels: the word of a pixel names a triangle, the pixel's ray meets
// it, and shading happens there. Each visible pixel is shaded once, whatever the number of points.
// In: Words [row][view][column], the batch, Eyes, RowOffsets. Out: ViewImages [view, row, column].

layout(local_size_x = 64) in;

#include "common/triangles.glsl"
#include "common/surface.glsl"
#include "common/vertices.glsl"
#include "common/shading.glsl"

layout(std430) readonly restrict buffer Words { uint words[]; };
layout(std430) readonly restrict buffer Eyes { float eyes[]; };
layout(std430) readonly restrict buffer RowOffsets { float row_offsets[]; };

layout(rgba16f, binding = 0) writeonly restrict uniform image2DArray view_images;

uniform mat4 world_from_display;
uniform vec3 background;

Surface surface_at(uint triangle, int view, int row, int column) {
    uvec4 corners = triangles[triangle];
    vec3 a = display_positions[corners.x].xyz;
    vec3 b = display_positions[corners.y].xyz;
    vec3 c = display_positions[corners.z].xyz;
    float eye_mm = eyes[view] * frame.column_mm;
    float x_mm = (float(column) + 0.5 - row_offsets[row]) * frame.column_mm;
    Plane plane = triangle_plane(a, b, c);
    Hit hit = hit_triangle(a, b, c, plane, eye_mm, x_mm, row_centre_mm(row));
    float side = eye_side(plane, eye_mm);

    Vertex va = vertices[corners.x], vb = vertices[corners.y], vc = vertices[corners.z];
    Draw draw = draws[corners.w];
    vec3 normal = mat3(vertex_normal(va), vertex_normal(vb), vertex_normal(vc)) * hit.weights;
    mat3x2 uv0 = mat3x2(va.uv0, vb.uv0, vc.uv0), uv1 = mat3x2(va.uv1, vb.uv1, vc.uv1);

    Surface surface;
    surface.p_world = (world_from_display * vec4(hit.p_display, 1.0)).xyz;
    surface.normal = mat3(draw.normal_matrix_x.xyz, draw.normal_matrix_y.xyz, draw.normal_matrix_z.xyz) * normal;
    surface.dp_dx = mat3(world_from_display) * hit.dp_dx;
    surface.dp_dy = mat3(world_from_display) * hit.dp_dy;
    surface.uv0 = Footprint(uv0 * hit.weights, uv0 * hit.weights_dx, uv0 * hit.weights_dy);
    surface.uv1 = Footprint(uv1 * hit.weights, uv1 * hit.weights_dx, uv1 * hit.weights_dy);
    surface.color = mat3x4(vertex_color(va), vertex_color(vb), vertex_color(vc)) * hit.weights;
    surface.material = draw.material;
    surface.back = (side < 0.0) != ((draw.facing & FACING_MIRRORED) != 0u);
    return surface;
}

void main() {
    int column = int(gl_GlobalInvocationID.x);
    int row = frame.band_first + int(gl_WorkGroupID.y), view = int(gl_WorkGroupID.z);
    if (column >= frame.columns) return;
    uint word = words[view_pixel(row, view, column)];
    ivec3 target = ivec3(column, row - frame.band_first, view);
    if (word == NO_TRIANGLE) {
        if (frame.triangle_base == 0u) imageStore(view_images, target, vec4(background, 0.0));
        return;
    }
    uint triangle = word - frame.triangle_base;
    if (triangle >= frame.triangles) return;  // of another batch
    Surface surface = surface_at(triangle, view, row, column);
    vec3 eye_world = (world_from_display * vec4(eyes[view] * frame.column_mm, 0.0, frame.distance_mm, 1.0)).xyz;
    imageStore(view_images, target, vec4(shade(surface, eye_world), 1.0));
}

// Deferred shading of visible view pixels: the word of a pixel names a triangle, the pixel's ray meets
// it, and shading happens there. Each visible pixel is shaded once, whatever the number of points.
// In: Words [row][view][column], Blocks, the batch, Eyes, RowOffsets. Out: view_images [view, row,
// column], which already hold the background.

layout(local_size_x = BLOCK, local_size_y = GROUP_BLOCKS) in;

#include "common/triangles.glsl"
#include "common/surface.glsl"
#include "common/vertices.glsl"
#include "common/shading.glsl"
#include "layout/BlockWork"

layout(std430) readonly restrict buffer Words { uint words[]; };
layout(std430) readonly restrict buffer Blocks { uint blocks[]; };
layout(std430) readonly restrict buffer BlockWorkBlock { BlockWork block_work; };
layout(std430) readonly restrict buffer Eyes { float eyes[]; };
layout(std430) readonly restrict buffer RowOffsets { float row_offsets[]; };

layout(rgba16f, binding = 0) writeonly restrict uniform image2DArray view_images;

uniform mat4 world_from_display;
uniform uint row_blocks;

Surface surface_at(uint triangle, int view, int row, int column) {
    uvec4 corners = triangles[triangle];
    vec3 a = display_positions[corners.x].xyz;
    vec3 b = display_positions[corners.y].xyz;
    vec3 c = display_positions[corners.z].xyz;
    float eye_mm = eyes[view] * frame.column_mm;
    float x_mm = (float(column) + 0.5 - row_offsets[row]) * frame.column_mm;
    Plane plane = triangle_plane(a, b, c);
    Hit hit = hit_triangle(a, b, c, plane, eye_mm, x_mm, row_centre_mm(row));
    mat3x2 uv0 = mat3x2(tex_coords[corners.x], tex_coords[corners.y], tex_coords[corners.z]);
    mat3x2 uv1 = mat3x2(vertex_uv1(corners.x), vertex_uv1(corners.y), vertex_uv1(corners.z));
    uint facing = draws[corners.w].facing;

    Surface surface;
    surface.p_world = (world_from_display * vec4(hit.p_display, 1.0)).xyz;
    surface.normal = mat3(direction_from(world_normals[corners.x]), direction_from(world_normals[corners.y]),
                          direction_from(world_normals[corners.z])) * hit.weights;
    surface.dp_dx = mat3(world_from_display) * hit.dp_dx;
    surface.dp_dy = mat3(world_from_display) * hit.dp_dy;
    surface.uv0 = Footprint(uv0 * hit.weights, uv0 * hit.weights_dx, uv0 * hit.weights_dy);
    surface.uv1 = Footprint(uv1 * hit.weights, uv1 * hit.weights_dx, uv1 * hit.weights_dy);
    surface.color = mat3x4(vertex_color(corners.x), vertex_color(corners.y), vertex_color(corners.z)) * hit.weights;
    surface.material = draws[corners.w].material;
    surface.back = (eye_side(plane, eye_mm) < 0.0) != ((facing & FACING_MIRRORED) != 0u);
    return surface;
}

void main() {
    uint group = gl_WorkGroupID.y * GROUPS_ACROSS + gl_WorkGroupID.x;
    uint place = group * GROUP_BLOCKS + gl_LocalInvocationID.y;
    if (place >= block_work.blocks) return;
    uint block = blocks[place], line = block / row_blocks;
    int column = int((block % row_blocks) * BLOCK + gl_LocalInvocationID.x);
    int band_row = int(line) / frame.views, view = int(line) % frame.views;
    if (column >= frame.columns) return;
    uint triangle = words[line * uint(frame.columns) + uint(column)] - frame.triangle_base;
    if (triangle >= frame.triangles) return;  // background, or of another batch
    Surface surface = surface_at(triangle, view, frame.band_first + band_row, column);
    vec3 eye_world = (world_from_display * vec4(eyes[view] * frame.column_mm, 0.0, frame.distance_mm, 1.0)).xyz;
    imageStore(view_images, ivec3(column, band_row, view), vec4(shade(surface, eye_world), 1.0));
}

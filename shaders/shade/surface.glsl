// The surface that a visible view pixel shows, found from the pixel's word, and the list of blocks of
// pixels that show any.

#include "common/triangles.glsl"
#include "common/surface.glsl"
#include "common/vertices.glsl"
#include "common/normals.glsl"
#include "common/shading.glsl"
#include "layout/BlockWork"

// Winners, each WORD_STRIDE words from the one before.
layout(std430) readonly restrict buffer Words { uint words[]; };
layout(std430) readonly restrict buffer Blocks { uint blocks[]; };
layout(std430) readonly restrict buffer BlockWorkBlock { BlockWork block_work; };
layout(std430) readonly restrict buffer Eyes { float eyes[]; };
layout(std430) readonly restrict buffer RowOffsets { float row_offsets[]; };

#include "common/multiview.glsl"

uniform mat4 turn_from_display;  // see Placement
uniform uint row_blocks;

// A pixel of the views and what it shows. Nothing: background, or a triangle of another batch.
struct Visible {
    ivec3 pixel;  // column, row of the band, view
    bool nothing;
    uint triangle;
};

Visible visible_pixel() {
    uint place = (gl_WorkGroupID.y * GROUPS_ACROSS + gl_WorkGroupID.x) * GROUP_BLOCKS + gl_LocalInvocationID.y;
    uint block = place < block_work.blocks ? blocks[place] : 0u, line = block / row_blocks;
    int column = int((block % row_blocks) * BLOCK + gl_LocalInvocationID.x);
    Visible seen;
    seen.pixel = ivec3(column, int(line) / frame.views, int(line) % frame.views);
    seen.nothing = place >= block_work.blocks || column >= frame.columns;
    if (seen.nothing) return seen;
    seen.triangle = words[WORD_STRIDE * (line * uint(frame.columns) + uint(column))] - frame.triangle_base;
    seen.nothing = seen.triangle >= frame.triangles;
    return seen;
}

// From vertex a to b and c. What is the same at all three stands still, exactly.
mat2 sides(mat3x2 uv) {
    return mat2(uv[1] - uv[0], uv[2] - uv[0]);
}

bool on_a_line(mat3x2 uv, mat2 sides) {
    vec2 most = max(abs(uv[0]), max(abs(uv[1]), abs(uv[2]))), lengths = abs(sides[0]) + abs(sides[1]);
    return abs(determinant(sides)) <= UV_ROUNDING * max(most.x, most.y) * (lengths.x + lengths.y);
}

Surface surface_at(uint triangle, int view, int row, int column) {
    uvec4 corners = triangles[triangle];
    vec3 a = display_positions[corners.x].xyz;
    vec3 b = display_positions[corners.y].xyz;
    vec3 c = display_positions[corners.z].xyz;
    float eye_mm = eyes[view] * frame.column_mm;
    Plane plane = triangle_plane(a, b, c);
    Hit hit = shaded_hit(triangle, a, b, c, plane, eye_mm, row, column);
    mat3x2 uv0 = mat3x2(tex_coords[corners.x], tex_coords[corners.y], tex_coords[corners.z]);
    mat3x2 uv1 = mat3x2(vertex_uv1(corners.x), vertex_uv1(corners.y), vertex_uv1(corners.z));
    uint facing = draws[corners.w].facing;
    vec3 views = LOD_RULE == LOD_MULTIVIEW ? footprint_views(triangle, plane, eye_mm, facing, depth_of(hit.p_display)) : ONE_VIEW;

    Surface surface;
    surface.to_eye = mat3(turn_from_display) * (vec3(eye_mm, 0.0, frame.distance_mm) - hit.p_display);
    surface.place = mat3(turn_from_display) * hit.p_display;
    surface.normal = mat3(vertex_normal(corners.x), vertex_normal(corners.y), vertex_normal(corners.z)) * hit.weights;
    surface.dp_dx = mat3(turn_from_display) * hit.dp_dx;
    surface.dp_dy = mat3(turn_from_display) * hit.dp_dy;
    mat2 sides0 = sides(uv0), sides1 = sides(uv1);
    surface.uv0 = Footprint(uv0 * hit.weights, sides0 * hit.weights_dx.yz, sides0 * hit.weights_dy.yz, views);
    surface.uv1 = Footprint(uv1 * hit.weights, sides1 * hit.weights_dx.yz, sides1 * hit.weights_dy.yz, views);
    surface.line0 = on_a_line(uv0, sides0);
    surface.line1 = on_a_line(uv1, sides1);
    surface.color = mat3x4(vertex_color(corners.x), vertex_color(corners.y), vertex_color(corners.z)) * hit.weights;
    surface.material = draws[corners.w].material;
    surface.back = (eye_side(plane, eye_mm) < 0.0) != ((facing & FACING_MIRRORED) != 0u);
    return surface;
}

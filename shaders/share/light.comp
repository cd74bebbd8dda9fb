// Lights visible view pixels: what views share, between the two cells about the place where the pixel's depth puts it in
// its track's middle view, and the pixel's own gloss.
// In: Depths, Blocks, Tracks, Cells, Eyes, RowOffsets. In, out: Words (of tracks; then nothing's). Out: view_images.

#define WORDS_WRITTEN
layout(local_size_x = BLOCK, local_size_y = GROUP_BLOCKS) in;

#include "common/frame.glsl"
#include "common/octahedral.glsl"
#include "common/gloss.glsl"
#include "shade/visible.glsl"
#include "share/packing.glsl"
#include "layout/Track"

layout(std430) readonly restrict buffer Depths { float depths[]; };
layout(std430) readonly restrict buffer Eyes { float eyes[]; };
layout(std430) readonly restrict buffer RowOffsets { float row_offsets[]; };

layout(rgba16f, binding = 0) writeonly restrict uniform image2DArray view_images;

uniform usamplerBuffer tracks;  // a texel a Track
uniform usamplerBuffer cells;
uniform mat4 turn_from_display;  // see Placement

void main() {
    ivec3 pixel = listed_pixel();
    if (pixel.x < 0) return;
    uint index = WORD_STRIDE * band_pixel(pixel), word = words[index];
    if (word == NO_TRIANGLE || (word & TRACK_WORD) == 0u) return;
    words[index] = NO_TRIANGLE;  // so that no other batch takes the track for its own
    // Depth is the second word of a pixel that has both in one buffer.
    float k = frame.distance_mm / depths[index + WORD_STRIDE - 1u];
    uvec4 texel = texelFetch(tracks, int(word & ~TRACK_WORD));
    Track track = Track(texel.x, uintBitsToFloat(texel.y), uintBitsToFloat(texel.z), texel.w);
    float eye = eyes[pixel.z], column = float(pixel.x) + 0.5;
    float at = column + (eyes[track.view_steps & (1u << STEPS_SHIFT) - 1u] - eye) * (1.0 - k);  // the shear identity
    uint steps = track.view_steps >> STEPS_SHIFT;
    float along = clamp((at - track.from) * track.steps_per_column, 0.0, float(steps)), before = floor(along);
    uint first = track.first_cell, cell = min(uint(before), max(steps, 1u) - 1u), next = min(cell + 1u, steps);
    vec3 previous = radiance_from(texelFetch(cells, int(first + max(cell, 1u) - 1u)).xy);
    vec3 following = radiance_from(texelFetch(cells, int(first + min(cell + 2u, steps))).xy);
    Matte here = matte_from(texelFetch(cells, int(first + cell))), there = matte_from(texelFetch(cells, int(first + next)));
    Matte matte = interpolated(previous, here, there, following, along - float(cell));

    int row = frame.band_first + pixel.y;
    vec2 window = vec2((column - row_offsets[row]) * frame.column_mm, row_centre_mm(row));
    vec3 ray = vec3(window.x - eye * frame.column_mm, window.y, -frame.distance_mm);
    vec3 p_display = vec3(eye * frame.column_mm, 0.0, frame.distance_mm) + ray / k;
    vec3 gloss = gloss_of(matte, normalize(mat3(turn_from_display) * -ray), mat3(turn_from_display) * p_display);
    imageStore(view_images, pixel, vec4(min(matte.radiance + gloss, MOST_RADIANCE), 1.0));
}

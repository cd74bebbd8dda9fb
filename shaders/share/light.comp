// Lights visible view pixels: what views share, between the two cells about the place where the pixel's depth puts it in
// its track's middle view, and the pixel's own gloss.
// In: Words (tracks, see mark.comp), Depths, Blocks, Tracks, Cells. Out: view_images.

layout(local_size_x = BLOCK, local_size_y = BLOCKS_ABREAST) in;

#include "common/frame.glsl"
#include "common/octahedral.glsl"
#include "common/gloss.glsl"
#include "shade/images.glsl"
#include "shade/visible.glsl"
#include "share/packing.glsl"
#include "layout/Track"

uniform usamplerBuffer Tracks;  // a texel a Track
uniform usamplerBuffer Cells;
uniform mat4 turn_from_display;  // see Placement
uniform uint first_track;  // see mark.comp
uniform uint most_tracks;

// A pixel's word and the bits of its depth.
#if WORD_STRIDE == 2
uniform usamplerBuffer Depths;  // of two pixels a texel, each after its word
uvec2 winner(uint pixel) {
    uvec4 two = texelFetch(Depths, int(pixel >> 1));
    return (pixel & 1u) == 0u ? two.xy : two.zw;
}
#else
layout(std430) readonly restrict buffer Depths { uint depths[]; };
uvec2 winner(uint pixel) {
    return uvec2(words[pixel], depths[pixel]);
}
#endif

// The eye of the view on whose columns a track's cells lie, in columns.
float track_eye(Track track) {
    const uint MOST = (1u << STEPS_SHIFT) - 1u;
    return mix(frame.eye_first, frame.eye_last, float(track.eye_steps & MOST) * (1.0 / float(MOST)));
}

void light_pixel(Listed here) {
    ivec3 pixel = here.pixel;
    if (pixel.x < 0) return;
    uvec2 seen = winner(band_pixel(pixel));
    uint index = seen.x - first_track;
    if (index >= most_tracks) return;  // background, or of another batch
    int row = frame.band_first + pixel.y;
    float k = frame.distance_mm / uintBitsToFloat(seen.y), eye = here.eye, column = float(pixel.x) + 0.5;
    uvec4 texel = texelFetch(Tracks, int(index));
    Track track = Track(texel.x, uintBitsToFloat(texel.y), uintBitsToFloat(texel.z), texel.w);
    float at = column + (track_eye(track) - eye) * (1.0 - k);  // the shear identity
    uint steps = track.eye_steps >> STEPS_SHIFT;
    float along = clamp((at - track.from) * track.steps_per_column, 0.0, float(steps)), before = floor(along);
    uint first = track.first_cell, cell = min(uint(before), max(steps, 1u) - 1u), next = min(cell + 1u, steps);
    vec3 previous = radiance_from(texelFetch(Cells, int(first + max(cell, 1u) - 1u)).xy);
    vec3 following = radiance_from(texelFetch(Cells, int(first + min(cell + 2u, steps))).xy);
    Matte one = matte_from(texelFetch(Cells, int(first + cell))), other = matte_from(texelFetch(Cells, int(first + next)));
    Matte matte = interpolated(previous, one, other, following, along - float(cell));

    vec2 window = vec2((column - here.row_offset) * frame.column_mm, row_centre_mm(row));
    vec3 ray = vec3(window.x - eye * frame.column_mm, window.y, -frame.distance_mm);
    vec3 p_display = vec3(eye * frame.column_mm, 0.0, frame.distance_mm) + ray / k;
    vec3 gloss = gloss_of(matte, normalize(mat3(turn_from_display) * -ray), mat3(turn_from_display) * p_display);
    store(pixel, min(matte.radiance + gloss, MOST_RADIANCE));
}

void main() {
    uvec2 places = own_places();
    for (uint place = places.x; place < places.y; place += BLOCKS_ABREAST) light_pixel(listed_pixel(place));
}

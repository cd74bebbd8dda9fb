// An equirectangular picture onto the faces of a cube, each texel the mean of a grid of directions.
// In: picture. Out: faces.

layout(local_size_x = 8, local_size_y = 8) in;

#include "prefilter/cube.glsl"

const float PI = 3.14159265359;
const int GRID = 4;

uniform sampler2DArray picture;
layout(rgba32f, binding = 0) writeonly restrict uniform imageCube faces;

// The convention of the Khronos glTF viewer: the middle is +x, right of it +z, above it +y.
vec2 picture_place(vec3 direction) {
    return vec2(0.5 + atan(direction.z, direction.x) / (2.0 * PI),
                atan(length(direction.xz), direction.y) / PI);
}

void main() {
    ivec3 texel = ivec3(gl_GlobalInvocationID);
    int size = imageSize(faces).x;
    if (max(texel.x, texel.y) >= size) return;
    vec3 sum = vec3(0.0);
    for (int i = 0; i < GRID * GRID; i++) {
        vec2 within = (vec2(i % GRID, i / GRID) + 0.5) / float(GRID);
        vec3 direction = face_direction(texel.z, 2.0 * (vec2(texel.xy) + within) / float(size) - 1.0);
        sum += textureLod(picture, vec3(picture_place(direction), 0.0), 0.0).rgb;
    }
    imageStore(faces, texel, vec4(sum / float(GRID * GRID), 1.0));
}

// Where shaded pixels go: scene-linear light, or what a picture holds of it where ENCODED is 1.

#if ENCODED
#include "common/encode.glsl"

uniform float exposure;

layout(rgba8, binding = 0) writeonly restrict uniform image2DArray view_images;

void store(ivec3 pixel, vec3 radiance) {
    imageStore(view_images, pixel, vec4(encoded(radiance, exposure), 1.0));
}
#else
layout(rgba16f, binding = 0) writeonly restrict uniform image2DArray view_images;

void store(ivec3 pixel, vec3 radiance) {
    imageStore(view_images, pixel, vec4(radiance, 1.0));
}
#endif

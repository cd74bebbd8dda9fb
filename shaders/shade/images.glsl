// Where shaded pixels go: scene-linear light as half floats hold it, or, where ENCODED is 1, what a picture holds of that.

#include "common/half.glsl"

#if ENCODED
#include "common/encode.glsl"

uniform float exposure;

layout(rgba8, binding = 0) writeonly restrict uniform image2DArray view_images;

void store(ivec3 pixel, vec3 radiance) {
    imageStore(view_images, pixel, vec4(encoded(nearest_half(radiance), exposure), 1.0));
}
#else
layout(rgba16f, binding = 0) writeonly restrict uniform image2DArray view_images;

void store(ivec3 pixel, vec3 radiance) {
    imageStore(view_images, pixel, vec4(nearest_half(radiance), 1.0));
}
#endif

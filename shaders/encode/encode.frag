// Scene-linear panel image → 8-bit sRGB. In: linear_image. Out: one texel a texel.

#include "common/encode.glsl"

uniform sampler2DArray linear_image;
uniform float exposure;
uniform int layer;

layout(location = 0) out vec4 picture;

void main() {
    vec3 radiance = texelFetch(linear_image, ivec3(ivec2(gl_FragCoord.xy), layer), 0).rgb;
    picture = vec4(encoded(radiance, exposure), 1.0);
}

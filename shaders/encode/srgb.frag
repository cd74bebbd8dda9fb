// Linear light of a display → 8-bit sRGB, without exposure and tone curve: pictures that have had
// theirs. In: linear_image. Out: one texel a texel.

#include "common/encode.glsl"

uniform sampler2DArray linear_image;
uniform int layer;

layout(location = 0) out vec4 picture;

void main() {
    vec3 light = texelFetch(linear_image, ivec3(ivec2(gl_FragCoord.xy), layer), 0).rgb;
    picture = vec4(srgb_from_linear(clamp(light, 0.0, 1.0)), 1.0);
}

// What a lobe mirrors of a cube map, for each texel of a level: a weighted mean over the lobe's samples.
// In: source, Samples (direction about +z times its share, level of the source). Out: faces.

layout(local_size_x = 8, local_size_y = 8) in;

#include "prefilter/cube.glsl"

layout(std430) readonly restrict buffer Samples { vec4 lobe[]; };
uniform samplerCube source;
uniform int samples;
layout(rgba16f, binding = 0) writeonly restrict uniform imageCube faces;

const vec3 MOST_RADIANCE = vec3(65504.0);  // what half floats hold

void main() {
    ivec3 texel = ivec3(gl_GlobalInvocationID);
    int size = imageSize(faces).x;
    if (max(texel.x, texel.y) >= size) return;
    vec3 normal = normalize(face_direction(texel.z, 2.0 * (vec2(texel.xy) + 0.5) / float(size) - 1.0));
    vec3 aside = abs(normal.y) < 0.9 ? vec3(0.0, 1.0, 0.0) : vec3(1.0, 0.0, 0.0);
    vec3 tangent = normalize(cross(aside, normal));
    mat3 frame = mat3(tangent, cross(normal, tangent), normal);
    vec3 sum = vec3(0.0);
    for (int i = 0; i < samples; i++)
        sum += length(lobe[i].xyz) * textureLod(source, frame * lobe[i].xyz, lobe[i].w).rgb;
    imageStore(faces, texel, vec4(min(sum, MOST_RADIANCE), 1.0));
}

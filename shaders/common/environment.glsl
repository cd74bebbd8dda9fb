// Light from all around, by ENVIRONMENT: the built-in studio, a picture, or none. World +y is up; where
// ADJUSTED is 1 the environment is turned about it and its intensity scaled.

#include "layout/EnvironmentLight"

layout(std140) uniform EnvironmentBlock {
    EnvironmentLight environment;
};

uniform samplerCube environment_map;

// A direction of the environment in the world, counter-clockwise seen from above by the
// turn of this sine; by the opposite sine, the other way.
vec3 turned(vec3 direction, float sine) {
    float cosine = environment.turn.x;
    if (ADJUSTED == 0) return direction;
    return vec3(cosine * direction.x + sine * direction.z, direction.y, cosine * direction.z - sine * direction.x);
}

vec3 scaled(vec3 light) {
    return ADJUSTED == 0 ? light : environment.turn.z * light;
}

// ---- the studio: a bright ceiling, a darker floor, a key light and a rim light. Each lobe widens with
// roughness, which stands for prefiltering.

const vec3 CEILING = vec3(0.62, 0.66, 0.74);
const vec3 HORIZON = vec3(0.34, 0.34, 0.36);
const vec3 FLOOR = vec3(0.13, 0.12, 0.11);

struct SoftBox {
    vec3 direction;  // from the scene, unit
    vec3 radiance;
    float sharpness; // of a mirror's reflection of it
};

const int SOFT_BOXES = 2;
const SoftBox SOFT_BOX[SOFT_BOXES] = SoftBox[](
    SoftBox(vec3(-0.5063697, 0.5625, 0.6534), vec3(5.0, 4.7, 4.3), 40.0),
    SoftBox(vec3(0.8320503, 0.3328, -0.4438), vec3(2.2, 2.6, 3.4), 60.0));

const vec3 KEY_DIRECTION = vec3(-0.4423954, 0.6635931, 0.6032666);  // towards the light
const vec3 KEY_IRRADIANCE = vec3(2.1, 2.0, 1.85);

vec3 studio_gradient(float up, float width) {
    float above = smoothstep(-width, width, up);
    return mix(FLOOR, mix(HORIZON, CEILING, smoothstep(0.0, 1.0 + width, up)), above);
}

// A spherical Gaussian of sharpness λ blurred by one of sharpness μ = 2/α² has about λμ/(λ + μ), its integral kept.
vec3 studio_radiance(vec3 direction, float roughness) {
    float half_width = 0.5 * max(1e-3, roughness * roughness * roughness * roughness);  // 1/μ
    vec3 radiance = studio_gradient(direction.y, 0.15 + roughness);
    for (int i = 0; i < SOFT_BOXES; i++) {
        float part = 1.0 / (1.0 + SOFT_BOX[i].sharpness * half_width), sharpness = part * SOFT_BOX[i].sharpness;
        float cosine = dot(direction, SOFT_BOX[i].direction);
        radiance += SOFT_BOX[i].radiance * part * exp(sharpness * (cosine - 1.0));
    }
    return radiance;
}

// Irradiance over π: the gradient at its widest and the soft boxes by their solid angle 2π/λ.
vec3 studio_diffuse(vec3 normal) {
    vec3 irradiance = studio_gradient(normal.y, 1.0);
    for (int i = 0; i < SOFT_BOXES; i++)
        irradiance += SOFT_BOX[i].radiance * (2.0 / SOFT_BOX[i].sharpness) * max(0.0, dot(normal, SOFT_BOX[i].direction));
    return irradiance;
}

// ---- a picture: a cube map whose levels hold what surfaces of growing roughness mirror (passes/prefilter.py)

// The last level is of roughness 1, each one before of √½ of the next's, and the first is a mirror's, which
// is mixed with the second as lobes widen, by roughness².
float roughness_level(float roughness) {
    float last = environment.turn.w, second = exp2(0.5 - 0.5 * last), share = roughness / second;
    return share < 1.0 ? share * share : last + 2.0 * log2(roughness);
}

// Irradiance over π of the picture's harmonics to order 2, as a quadratic form (Ramamoorthi and Hanrahan
// 2001, equations 11 and 12); a small bright light makes it ring below 0.
vec3 picture_diffuse(vec3 normal) {
    vec4 n = vec4(normal, 1.0);
    return max(vec3(0.0), vec3(dot(n, environment.diffuse_red * n), dot(n, environment.diffuse_green * n), dot(n, environment.diffuse_blue * n)));
}

// ---- whichever it is

// Radiance from a direction of the world, blurred over a lobe of the roughness.
vec3 environment_radiance(vec3 direction, float roughness) {
    vec3 from = turned(direction, -environment.turn.y);
    vec3 radiance = vec3(0.0);
    if (ENVIRONMENT == STUDIO) radiance = studio_radiance(from, roughness);
    if (ENVIRONMENT == PICTURE) radiance = textureLod(environment_map, from, roughness_level(roughness)).rgb;
    return scaled(radiance);
}

// Irradiance over π on a surface.
vec3 environment_diffuse(vec3 normal) {
    vec3 n = turned(normal, -environment.turn.y);
    vec3 irradiance = vec3(0.0);
    if (ENVIRONMENT == STUDIO) irradiance = studio_diffuse(n);
    if (ENVIRONMENT == PICTURE) irradiance = picture_diffuse(n);
    return scaled(irradiance);
}

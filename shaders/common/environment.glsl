// The built-in studio: a bright ceiling, a darker floor, a key light and a rim light. Each lobe widens
// with roughness, which stands for prefiltering; world +y is up.

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

const vec3 KEY_DIRECTION = vec3(-0.4423259, 0.6634888, 0.6031718);  // towards the light
const vec3 KEY_IRRADIANCE = vec3(2.1, 2.0, 1.85);

vec3 studio_gradient(float up, float width) {
    float above = smoothstep(-width, width, up);
    return mix(FLOOR, mix(HORIZON, CEILING, smoothstep(0.0, 1.0 + width, up)), above);
}

// Radiance from a direction, blurred over a lobe of the roughness. A spherical Gaussian of sharpness λ
// blurred by one of sharpness μ has about λμ/(λ + μ), its integral kept.
vec3 environment_radiance(vec3 direction, float roughness) {
    float lobe = 2.0 / max(1e-3, roughness * roughness * roughness * roughness);
    vec3 radiance = studio_gradient(direction.y, 0.15 + roughness);
    for (int i = 0; i < SOFT_BOXES; i++) {
        float sharpness = SOFT_BOX[i].sharpness * lobe / (SOFT_BOX[i].sharpness + lobe);
        float cosine = dot(direction, SOFT_BOX[i].direction);
        radiance += SOFT_BOX[i].radiance * (sharpness / SOFT_BOX[i].sharpness) * exp(sharpness * (cosine - 1.0));
    }
    return radiance;
}

// Irradiance over π: the gradient at its widest and the soft boxes by their solid angle 2π/λ.
vec3 environment_diffuse(vec3 normal) {
    vec3 irradiance = studio_gradient(normal.y, 1.0);
    for (int i = 0; i < SOFT_BOXES; i++)
        irradiance += SOFT_BOX[i].radiance * (2.0 / SOFT_BOX[i].sharpness) * max(0.0, dot(normal, SOFT_BOX[i].direction));
    return irradiance;
}

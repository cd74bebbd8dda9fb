// The part of shading that depends on the eye, and what it needs of a surface.

#include "common/environment.glsl"
#include "common/lights.glsl"

const float PI = 3.14159265359;
const vec3 MOST_RADIANCE = vec3(65504.0);  // what half floats hold
const float SMALLEST_ALPHA = 0.002;  // keeps the specular peak of a mirror finite

// Environment BRDF: scale and bias of the specular colour, a polynomial fit by Karis (2014, "Physically
// based shading on mobile").
vec2 environment_brdf(float roughness, float n_dot_v) {
    vec4 r = roughness * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
    float a = min(r.x * r.x, exp2(-9.28 * n_dot_v)) * r.x + r.y;
    return vec2(-1.04, 1.04) * a + r.zw;
}

// Cook-Torrance with GGX, Smith's height-correlated masking and Schlick's Fresnel (glTF, appendix B.3), the two quotients
// in one.
vec3 specular_brdf(vec3 f0, float alpha, float n_dot_l, float n_dot_v, float n_dot_h, float v_dot_h) {
    float a2 = alpha * alpha;
    float peak = n_dot_h * n_dot_h * (a2 - 1.0) + 1.0;
    float masks = n_dot_l * sqrt(n_dot_v * n_dot_v * (1.0 - a2) + a2) + n_dot_v * sqrt(n_dot_l * n_dot_l * (1.0 - a2) + a2);
    float away = 1.0 - v_dot_h, away_2 = away * away;
    vec3 fresnel = f0 + (1.0 - f0) * (away_2 * away_2 * away);
    return fresnel * (0.5 * a2 / (PI * peak * peak * masks));
}

// What a surface mirrors of light from a unit direction. across: the cosine between normal and view, which may be below
// the least that n_dot_v is.
vec3 mirrored(vec3 f0, float alpha, float n_dot_v, float across, vec3 normal, vec3 view, vec3 to_light, vec3 irradiance) {
    float n_dot_l = dot(normal, to_light);
    if (n_dot_l <= 0.0) return vec3(0.0);
    // Of halfway = (view + to_light) / |view + to_light| only cosines are needed.
    float v_dot_l = dot(view, to_light), scale = inversesqrt(max(2.0 + 2.0 * v_dot_l, 1e-12));
    float n_dot_h = clamp((across + n_dot_l) * scale, 0.0, 1.0), v_dot_h = clamp((1.0 + v_dot_l) * scale, 0.0, 1.0);
    return irradiance * n_dot_l * specular_brdf(f0, alpha, n_dot_l, n_dot_v, n_dot_h, v_dot_h);
}

// What of a surface's light does not depend on the eye: what it scatters and sends, and what its gloss is made of.
struct Matte {
    vec3 radiance;
    vec3 normal;       // unit
    vec3 f0;
    float roughness;
    float occlusion;
    bool glossy;
    float opacity;
};

// Light mirrored towards an eye in the direction `view`, unit, from a place.
vec3 gloss_of(Matte matte, vec3 view, vec3 place) {
    if (!matte.glossy) return vec3(0.0);
    vec3 normal = matte.normal;
    float across = dot(normal, view), n_dot_v = clamp(abs(across), 1e-4, 1.0), alpha = max(SMALLEST_ALPHA, matte.roughness * matte.roughness);
    vec2 brdf = environment_brdf(matte.roughness, n_dot_v);
    vec3 radiance = matte.occlusion * max(matte.f0 * brdf.x + brdf.y, 0.0) * environment_radiance(2.0 * across * normal - view, matte.roughness);
    if (LIGHTS == 0 && ENVIRONMENT == STUDIO)
        radiance += mirrored(matte.f0, alpha, n_dot_v, across, normal, view, turned(KEY_DIRECTION, environment.turn.y), scaled(KEY_IRRADIANCE));
    for (int i = 0; i < LIGHTS; i++) {
        Arrival light = light_arriving(i, place);
        radiance += mirrored(matte.f0, alpha, n_dot_v, across, normal, view, light.direction, light.irradiance);
    }
    return radiance;
}

// glTF 2.0 metallic-roughness (specification, appendix B) under the studio. One function serves every
// technique; it returns scene-linear radiance.

#include "common/environment.glsl"
#include "common/textures.glsl"

const float PI = 3.14159265359;
const float SMALLEST_ALPHA = 0.002;  // keeps the specular peak of a mirror finite

struct Surface {
    vec3 p_world;
    vec3 normal;       // interpolated, world, any length
    vec3 dp_dx;        // change of p_world over a column and a row
    vec3 dp_dy;
    Footprint uv0;
    Footprint uv1;
    vec4 color;        // vertex colour, linear
    uint material;
    bool back;         // seen from behind
};

// Tangent frame from the gradients of position and texture coordinate, so that files without tangents
// and files with them shade alike. +Y of the map is up in the picture, against v.
vec3 mapped_normal(vec3 normal, Surface surface, TextureSlot slot) {
    Footprint f = slot_footprint(slot, surface.uv0, surface.uv1);
    float determinant = f.dx.x * f.dy.y - f.dx.y * f.dy.x;
    if (determinant == 0.0) return normal;
    vec3 along_u = (surface.dp_dx * f.dy.y - surface.dp_dy * f.dx.y) * sign(determinant);
    vec3 along_v = (surface.dp_dy * f.dx.x - surface.dp_dx * f.dy.x) * sign(determinant);
    vec3 tangent = along_u - normal * dot(normal, along_u);
    vec3 bitangent = -(along_v - normal * dot(normal, along_v));
    float length_t = dot(tangent, tangent), length_b = dot(bitangent, bitangent);
    if (length_t == 0.0 || length_b == 0.0) return normal;
    vec3 m = sample_linear(slot, f).xyz * 2.0 - 1.0;
    m.xy *= slot.scale;
    vec3 mapped = m.x * tangent * inversesqrt(length_t) + m.y * bitangent * inversesqrt(length_b) + m.z * normal;
    return normalize(mapped);
}

// Environment BRDF: scale and bias of the specular colour, a polynomial fit by Karis (2014, "Physically
// based shading on mobile").
vec2 environment_brdf(float roughness, float n_dot_v) {
    vec4 r = roughness * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
    float a = min(r.x * r.x, exp2(-9.28 * n_dot_v)) * r.x + r.y;
    return vec2(-1.04, 1.04) * a + r.zw;
}

// Cook-Torrance with GGX, Smith's height-correlated masking and Schlick's Fresnel (glTF, appendix B.3).
vec3 specular_brdf(vec3 f0, float alpha, float n_dot_l, float n_dot_v, float n_dot_h, float v_dot_h) {
    float a2 = alpha * alpha;
    float peak = n_dot_h * n_dot_h * (a2 - 1.0) + 1.0;
    float distribution = a2 / (PI * peak * peak);
    float masking = 0.5 / (n_dot_l * sqrt(n_dot_v * n_dot_v * (1.0 - a2) + a2)
                         + n_dot_v * sqrt(n_dot_l * n_dot_l * (1.0 - a2) + a2));
    vec3 fresnel = f0 + (1.0 - f0) * pow(1.0 - v_dot_h, 5.0);
    return fresnel * distribution * masking;
}

vec3 shade(Surface surface, vec3 eye_world) {
    Material material = materials[surface.material];
    vec4 base_color = material.base_color * surface.color;
    TextureSlot slot = slot_of(surface.material, BASE_COLOR);
    if (slot.group >= 0) base_color *= sample_srgb(slot, slot_footprint(slot, surface.uv0, surface.uv1));
    if (material.unlit != 0u) return base_color.rgb;

    float metallic = material.metallic, roughness = material.roughness, occlusion = 1.0;
    slot = slot_of(surface.material, METALLIC_ROUGHNESS);
    vec4 packed_maps = vec4(1.0);
    if (slot.group >= 0) packed_maps = sample_linear(slot, slot_footprint(slot, surface.uv0, surface.uv1));
    roughness *= packed_maps.g;
    metallic *= packed_maps.b;
    TextureSlot occlusion_slot = slot_of(surface.material, OCCLUSION);
    if (occlusion_slot.group >= 0) {
        bool same = occlusion_slot.group == slot.group && occlusion_slot.layer == slot.layer;
        if (!same) packed_maps = sample_linear(occlusion_slot, slot_footprint(occlusion_slot, surface.uv0, surface.uv1));
        occlusion = 1.0 + occlusion_slot.scale * (packed_maps.r - 1.0);
    }

    vec3 normal = surface.normal * inversesqrt(max(1e-20, dot(surface.normal, surface.normal)));
    slot = slot_of(surface.material, NORMAL);
    if (slot.group >= 0) normal = mapped_normal(normal, surface, slot);
    if (surface.back) normal = -normal;

    vec3 view = normalize(eye_world - surface.p_world);
    float n_dot_v = clamp(abs(dot(normal, view)), 1e-4, 1.0);
    vec3 f0 = mix(vec3(0.04), base_color.rgb, metallic);
    vec3 albedo = base_color.rgb * (1.0 - metallic);
    float alpha = max(SMALLEST_ALPHA, roughness * roughness);

    vec2 brdf = environment_brdf(roughness, n_dot_v);
    vec3 radiance = occlusion * (albedo * environment_diffuse(normal)
        + (f0 * brdf.x + brdf.y) * environment_radiance(reflect(-view, normal), roughness));

    float n_dot_l = dot(normal, KEY_DIRECTION);
    if (n_dot_l > 0.0) {
        vec3 halfway = normalize(view + KEY_DIRECTION);
        vec3 specular = specular_brdf(f0, alpha, n_dot_l, n_dot_v, clamp(dot(normal, halfway), 0.0, 1.0), clamp(dot(view, halfway), 0.0, 1.0));
        radiance += KEY_IRRADIANCE * n_dot_l * (albedo / PI + specular);
    }

    slot = slot_of(surface.material, EMISSIVE);
    vec3 emissive = material.emissive.rgb;
    if (slot.group >= 0) emissive *= sample_srgb(slot, slot_footprint(slot, surface.uv0, surface.uv1)).rgb;
    return radiance + emissive;
}

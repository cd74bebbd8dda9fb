// glTF 2.0 metallic-roughness (specification, appendix B) under the environment and the scene's lights.
// One function serves every technique; it returns scene-linear radiance.

#include "common/gloss.glsl"
#include "common/textures.glsl"

const float UV_ROUNDING = 5e-7;  // of texture coordinates, relative: what a file's own arithmetic leaves
const float LEAST_SINE = 2e-6;  // between changes of texture coordinates that are not one line: 32 roundings

struct Surface {
    vec3 to_eye;       // world, any length; not two positions, which lose precision far from 0
    vec3 place;        // from the window's centre, world directions, the unit of lights
    vec3 normal;       // interpolated, world, any length
    vec3 dp_dx;        // change of world position over a column and a row
    vec3 dp_dy;
    Footprint uv0;
    Footprint uv1;
    bool line0;        // whether uv0 of this triangle lies on one line, but for rounding
    bool line1;
    vec4 color;        // vertex colour, linear
    uint material;
    bool back;         // seen from behind
};

// Tangent frame from the gradients of position and texture coordinate, so that files without tangents
// and files with them shade alike. It is square, as glTF's is, also where texture coordinates are skewed. +Y
// of the map is up in the picture, against v. Coordinates without area have no frame: the map is left out.
vec3 mapped_normal(vec3 normal, Surface surface, uint slot) {
    Footprint f = slot_footprint(surface.material, NORMAL, surface.uv0, surface.uv1);
    float determinant = f.dx.x * f.dy.y - f.dx.y * f.dy.x;
    if (second_set(slot) ? surface.line1 : surface.line0) return normal;
    if (abs(determinant) <= LEAST_SINE * length(f.dx) * length(f.dy)) return normal;  // a transform that flattens
    vec3 along_u = (surface.dp_dx * f.dy.y - surface.dp_dy * f.dx.y) * sign(determinant);
    vec3 along_v = (surface.dp_dy * f.dx.x - surface.dp_dx * f.dy.x) * sign(determinant);
    vec3 tangent = along_u - normal * dot(normal, along_u);
    vec3 bitangent = cross(normal, tangent);
    float side = -sign(dot(bitangent, along_v)), length_2 = dot(tangent, tangent);
    if (length_2 == 0.0 || side == 0.0) return normal;
    vec3 m = sample_linear(slot, f).xyz * 2.0 - 1.0;
    m.xy *= normal_scale(surface.material);
    return normalize((m.x * tangent + m.y * side * bitangent) * inversesqrt(length_2) + m.z * normal);
}

// Unit, to the side that is seen.
vec3 shading_normal(Surface surface) {
    vec3 normal = surface.normal * inversesqrt(max(1e-20, dot(surface.normal, surface.normal)));
    uint slot = slot_of(surface.material, NORMAL);
    if (slot != NO_TEXTURE) normal = mapped_normal(normal, surface, slot);
    return surface.back ? -normal : normal;
}

// Base colour with its texture and the vertices' colours, linear, alpha included.
vec4 base_color_of(Surface surface, int rule) {
    vec4 color = material_base_color(surface.material) * surface.color;
    uint slot = slot_of(surface.material, BASE_COLOR);
    if (slot != NO_TEXTURE)
        color *= sample_srgb(slot, slot_footprint(surface.material, BASE_COLOR, surface.uv0, surface.uv1), rule);
    return color;
}

// Occlusion, roughness, metallic, as the maps' channels lie (r, g, b).
vec3 occlusion_roughness_metallic(Surface surface) {
    vec2 factors = metallic_roughness(surface.material);
    uint slot = slot_of(surface.material, METALLIC_ROUGHNESS), occlusion_slot = slot_of(surface.material, OCCLUSION);
    vec4 maps = vec4(1.0);
    if (slot != NO_TEXTURE)
        maps = sample_linear(slot, slot_footprint(surface.material, METALLIC_ROUGHNESS, surface.uv0, surface.uv1));
    float occlusion = maps.r;
    // Files nearly always pack both in one texture, which SHARED_OCCLUSION says of the whole scene.
    if (SHARED_OCCLUSION == 0 && occlusion_slot != NO_TEXTURE)
        occlusion = sample_linear(occlusion_slot, slot_footprint(surface.material, OCCLUSION, surface.uv0, surface.uv1)).r;
    float strength = occlusion_strength(surface.material);
    occlusion = occlusion_slot == NO_TEXTURE ? 1.0 : 1.0 + strength * (occlusion - 1.0);
    return vec3(occlusion, maps.g * factors.y, maps.b * factors.x);
}

vec3 emitted(Surface surface) {
    vec3 radiance = emissive_factor(surface.material);
    uint slot = slot_of(surface.material, EMISSIVE);
    if (slot != NO_TEXTURE)
        radiance *= sample_srgb(slot, slot_footprint(surface.material, EMISSIVE, surface.uv0, surface.uv1), LOD_RULE).rgb;
    return radiance;
}

Matte matte_of(Surface surface) {
    vec4 base_color = base_color_of(surface, LOD_RULE);
    if (is_unlit(surface.material))
        return Matte(base_color.rgb, vec3(0.0, 0.0, 1.0), vec3(0.0), 1.0, 0.0, false, base_color.a);
    vec3 orm = occlusion_roughness_metallic(surface), normal = shading_normal(surface);
    vec3 albedo = base_color.rgb * (1.0 - orm.b);
    vec3 arriving = orm.r * environment_diffuse(normal);
    if (LIGHTS == 0 && ENVIRONMENT == STUDIO)
        arriving += scaled(KEY_IRRADIANCE * (max(0.0, dot(normal, turned(KEY_DIRECTION, environment.turn.y))) / PI));
    for (int i = 0; i < LIGHTS; i++) {
        Arrival light = light_arriving(i, surface.place);
        arriving += light.irradiance * (max(0.0, dot(normal, light.direction)) / PI);
    }
    return Matte(albedo * arriving + emitted(surface), normal, mix(vec3(0.04), base_color.rgb, orm.b), orm.g, orm.r, true, base_color.a);
}

// Radiance towards the eye and opacity.
vec4 shade(Surface surface) {
    Matte matte = matte_of(surface);
    vec3 gloss = gloss_of(matte, normalize(surface.to_eye), surface.place);
    return vec4(min(matte.radiance + gloss, MOST_RADIANCE), matte.opacity);
}

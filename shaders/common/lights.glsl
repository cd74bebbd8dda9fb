// The scene's own lights (KHR_lights_punctual): directional, point and spot. Without any, LIGHTS is 0 and
// nothing of this runs. Places are told from the window's centre, in
// world directions and the unit of Placement.turn_from_display, and so are candela.

#include "layout/Light"

const float MOST_IRRADIANCE = 1e20;  // keeps what a light touches finite

layout(std140) uniform LightBlock {
    Light lights[LIGHTS == 0 ? 1 : LIGHTS];
};

// Light that comes from one direction, as it falls on a surface that faces it.
struct Arrival {
    vec3 direction;  // towards the light, unit
    vec3 irradiance;
};

Arrival light_arriving(int index, vec3 place) {
    Light light = lights[index];
    vec3 to_light = light.place.xyz - light.place.w * place;
    float distance_2 = max(dot(to_light, to_light), 1e-36);
    vec3 direction = to_light * inversesqrt(distance_2);
    float cone = clamp(dot(light.axis.xyz, -direction) * light.fall.x + light.fall.y, 0.0, 1.0);
    float reach = distance_2 * light.fall.z * light.fall.z;
    float window = light.place.w == 0.0 ? 1.0 : clamp(1.0 - reach * reach, 0.0, 1.0) / distance_2;
    return Arrival(direction, min(light.intensity.xyz * (window * cone * cone), MOST_IRRADIANCE));
}

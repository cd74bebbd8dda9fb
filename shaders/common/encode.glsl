// Scene-linear light to a picture: exposure, tone curve, sRGB.

// Khronos PBR Neutral tone curve: true to base colours below the shoulder, desaturating above it
// (Khronos 2024, "PBR Neutral tone mapping specification").
vec3 neutral_tone(vec3 color) {
    const float SHOULDER = 0.8 - 0.04, DESATURATION = 0.15;
    float least = min(color.r, min(color.g, color.b));
    float offset = least < 0.08 ? least - 6.25 * least * least : 0.04;
    color -= offset;
    float peak = max(color.r, max(color.g, color.b));
    if (peak < SHOULDER) return color;
    float range = 1.0 - SHOULDER;
    float compressed = 1.0 - range * range / (peak + range - SHOULDER);
    color *= compressed / peak;
    float white = 1.0 - 1.0 / (DESATURATION * (peak - compressed) + 1.0);
    return mix(color, vec3(compressed), white);
}

// sRGB transfer function (IEC 61966-2-1).
vec3 srgb_from_linear(vec3 linear) {
    vec3 low = linear * 12.92;
    vec3 high = 1.055 * pow(max(linear, vec3(1e-6)), vec3(1.0 / 2.4)) - 0.055;
    return mix(high, low, lessThanEqual(linear, vec3(0.0031308)));
}

vec3 encoded(vec3 radiance, float exposure) {
    vec3 exposed = min(max(radiance, 0.0) * exposure, 65504.0);  // infinite light has no tone
    return srgb_from_linear(clamp(neutral_tone(exposed), 0.0, 1.0));
}

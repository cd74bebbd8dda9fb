// Scene-linear light to a picture: exposure, tone curve, sRGB.

// Tone curve: true to light below the shoulder, bright light approaches 1 above it, with no kink between.
// Each channel by itself: the three subpixels of a panel pixel belong to different views, and a curve
// that mixed them would let what one view sees colour another.
vec3 shouldered(vec3 light) {
    const float SHOULDER = 0.8, ROOM = 1.0 - SHOULDER;
    vec3 above = 1.0 - ROOM * ROOM / (max(light, SHOULDER) + ROOM - SHOULDER);
    return mix(light, above, greaterThan(light, vec3(SHOULDER)));
}

// sRGB transfer function (IEC 61966-2-1) from 0 to 1. 1.055·x^(1/2.4) − 0.055 is a polynomial of the fourth root but for
// 1.4e-4 levels of 255 (Chebyshev, degree 7, float32), and two roots cost less than a power.
vec3 srgb_from_linear(vec3 linear) {
    vec3 low = linear * 12.92, r = sqrt(sqrt(linear));
    vec3 high = -0.05851341 + r * (0.12453703 + r * (1.45586885 + r * (-1.13820809 + r * (1.17733616 + r * (-0.86538979
              + r * (0.37633484 - 0.07196584 * r))))));
    return mix(high, low, lessThanEqual(linear, vec3(0.0031308)));
}

vec3 encoded(vec3 radiance, float exposure) {
    vec3 exposed = min(max(radiance, 0.0) * exposure, 65504.0);  // infinite light has no tone
    return srgb_from_linear(clamp(shouldered(exposed), 0.0, 1.0));
}

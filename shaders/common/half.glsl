// To the nearest half float, which conversion then keeps: devices in software cut.

vec3 nearest_half(vec3 x) {
    return uintBitsToFloat(floatBitsToUint(x) + 0x1000u & ~0x1FFFu);
}

vec4 nearest_half(vec4 x) {
    return uintBitsToFloat(floatBitsToUint(x) + 0x1000u & ~0x1FFFu);
}

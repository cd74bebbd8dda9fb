// The point of a triangle closest to p, by the region that p's foot lies in (Ericson 2005, section 5.1.5).
vec3 closest_on_triangle(vec3 p, vec3 a, vec3 b, vec3 c) {
    vec3 ab = b - a, ac = c - a;
    float d1 = dot(ab, p - a), d2 = dot(ac, p - a);
    if (d1 <= 0.0 && d2 <= 0.0) return a;
    float d3 = dot(ab, p - b), d4 = dot(ac, p - b);
    if (d3 >= 0.0 && d4 <= d3) return b;
    float d5 = dot(ab, p - c), d6 = dot(ac, p - c);
    if (d6 >= 0.0 && d5 <= d6) return c;
    float weight_c = d1 * d4 - d3 * d2, weight_b = d5 * d2 - d1 * d6, weight_a = d3 * d6 - d5 * d4;
    if (weight_c <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return a + ab * (d1 / (d1 - d3));
    if (weight_b <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return a + ac * (d2 / (d2 - d6));
    float along = d4 - d3, back = d5 - d6;
    if (weight_a <= 0.0 && along >= 0.0 && back >= 0.0) return b + (c - b) * (along / (along + back));
    return a + (ab * weight_b + ac * weight_c) / max(weight_a + weight_b + weight_c, 1e-30);
}

// Material textures: 2D arrays grouped by colour space, size and wrap, and the levels and taps by which
// a fetch covers a view pixel's footprint. LOD_RULE says how (LOD_* of the layout).

#include "common/material.glsl"

uniform sampler2DArray srgb_maps[SRGB_GROUPS];
uniform sampler2DArray linear_maps[LINEAR_GROUPS];

// The rule by which coverage is decided, the same in all passes: of one tap, and of this view alone.
const int ALPHA_RULE = LOD_RULE == LOD_MULTIVIEW || LOD_RULE == LOD_ANISOTROPIC ? LOD_AREA : LOD_RULE;

// A texture coordinate and its change over a column and a row. views: the areas of the smallest and the
// largest footprint that any view has there, over this one's area, and the weight of the larger's texel
// (only the rule `multiview` reads them; common/multiview.glsl).
struct Footprint {
    vec2 uv;
    vec2 dx;
    vec2 dy;
    vec3 views;
};

const vec3 ONE_VIEW = vec3(1.0, 1.0, 0.0);

// Whether a slot reads the second set of texture coordinates.
bool second_set(uint slot) {
    return VERTEX_EXTRAS != 0 && (slot >> (SLOT_GROUP_BITS + SLOT_LAYER_BITS)) == 1u;
}

Footprint slot_footprint(uint material, uint role, Footprint uv0, Footprint uv1) {
    Footprint f = uv0;
    if (second_set(slot_of(material, role))) f = uv1;
    if (UV_TRANSFORMS == 0) return f;
    UvTransform transform = uv_transforms[material * TEXTURE_ROLES + role];
    mat2 m = mat2(transform.matrix.xy, transform.matrix.zw);
    return Footprint(m * f.uv + transform.offset, m * f.dx, m * f.dy, f.views);
}

// Trilinear taps of one fetch, in even steps. The first has a level and a weight of its own.
struct Taps {
    int count;
    vec2 first;  // texture coordinate
    vec2 step;
    vec2 lods;     // of the first tap, and of the others
    vec2 weights;
};

Taps one_tap(Footprint f, float lod) {
    return Taps(1, f.uv, vec2(0.0), vec2(lod), vec2(1.0));
}

float lod_of_area(float texels) {
    return 0.5 * log2(clamp(texels, 1e-12, 1e24));
}

// Equations 6, 7 and 9 of Gavane and Watson 2024: a level for the smallest and one for the largest.
Taps multiview_taps(Footprint f, float texels) {
    vec2 lods = vec2(lod_of_area(f.views.x * texels), lod_of_area(f.views.y * texels));
    return Taps(f.views.z > 0.0 ? 2 : 1, f.uv, vec2(0.0), lods, vec2(1.0 - f.views.z, f.views.z));
}

// Taps along the long axis of an ellipse a width of its short one: they are further apart than they are wide, since what
// interpolation between texels takes in is wider still (docs/performance.md).
const float TAPS_PER_WIDTH = 0.7;

// The footprint as an ellipse: the circle about a pixel, of a pixel's diameter, by the Jacobian. Taps
// stand along its long axis, each as wide as the short one (Heckbert 1989; McCormack et al. 1999).
Taps anisotropic_taps(Footprint f, vec2 x, vec2 y, float texels, vec2 size) {
    float xx = x.x * x.x + y.x * y.x, xy = x.x * x.y + y.x * y.y, yy = x.y * x.y + y.y * y.y;
    float half_gap = length(vec2(0.5 * (xx - yy), xy));
    float major = sqrt(0.5 * (xx + yy) + half_gap);
    float minor = texels / max(major, 1e-12);
    float ratio = clamp(major / max(minor, 1.0), 1.0, float(MOST_ASPECT));
    // Of two forms of the long axis the one whose terms do not cancel.
    vec2 axis = xx > yy ? vec2(0.5 * (xx - yy) + half_gap, xy) : vec2(xy, 0.5 * (yy - xx) + half_gap);
    float count = ceil(TAPS_PER_WIDTH * ratio);
    vec2 step = axis * (major / (count * max(length(axis), 1e-30))) / size;
    return Taps(int(count), f.uv - 0.5 * (count - 1.0) * step, step, vec2(log2(max(major, 1e-6) / ratio)), vec2(1.0 / count));
}

// size: of the texture, texels across and down.
Taps taps_of(Footprint f, vec2 size, int rule) {
    if (rule == LOD_NONE) return one_tap(f, 0.0);
    vec2 x = clamp(f.dx * size, -1e8, 1e8), y = clamp(f.dy * size, -1e8, 1e8);  // squares of squares stay finite
    if (rule == LOD_LONG_AXIS) return one_tap(f, lod_of_area(max(dot(x, x), dot(y, y))));
    float texels = abs(x.x * y.y - x.y * y.x);
    if (rule == LOD_MULTIVIEW) return multiview_taps(f, texels);
    if (rule == LOD_ANISOTROPIC) return anisotropic_taps(f, x, y, texels, size);
    return one_tap(f, lod_of_area(texels));
}

int slot_group(uint slot) {
    return int(slot & ((1u << SLOT_GROUP_BITS) - 1u));
}

// Where a tap lies: coordinates and layer.
vec3 tap_place(Taps taps, int tap, uint slot) {
    return vec3(taps.first + float(tap) * taps.step, float(slot >> SLOT_GROUP_BITS & ((1u << SLOT_LAYER_BITS) - 1u)));
}

// Groups differ between lanes, and sampler indices must not; hence the selections. Loops over groups are
// the inner ones and short, so that compilers unroll them: llvmpipe takes an index from the first lane
// even where that lane is idle. The twins differ in the array of samplers, which GLSL does not pass on
// where its length varies.
vec4 sample_srgb(uint slot, Footprint f, int rule) {
    vec2 size = vec2(1.0);
    for (int group = 0; group < SRGB_GROUPS; group++)
        if (slot_group(slot) == group) size = vec2(textureSize(srgb_maps[group], 0).xy);
    Taps taps = taps_of(f, size, rule);
    vec4 sum = vec4(0.0);
    int tap = 0;
    do {
        vec4 texel = vec4(1.0);
        for (int group = 0; group < SRGB_GROUPS; group++)
            if (slot_group(slot) == group) texel = textureLod(srgb_maps[group], tap_place(taps, tap, slot), tap == 0 ? taps.lods.x : taps.lods.y);
        sum += (tap == 0 ? taps.weights.x : taps.weights.y) * texel;
    } while (++tap < taps.count);
    return sum;
}

vec4 sample_linear(uint slot, Footprint f) {
    vec2 size = vec2(1.0);
    for (int group = 0; group < LINEAR_GROUPS; group++)
        if (slot_group(slot) == group) size = vec2(textureSize(linear_maps[group], 0).xy);
    Taps taps = taps_of(f, size, LOD_RULE);
    vec4 sum = vec4(0.0);
    int tap = 0;
    do {
        vec4 texel = vec4(1.0);
        for (int group = 0; group < LINEAR_GROUPS; group++)
            if (slot_group(slot) == group) texel = textureLod(linear_maps[group], tap_place(taps, tap, slot), tap == 0 ? taps.lods.x : taps.lods.y);
        sum += (tap == 0 ? taps.weights.x : taps.weights.y) * texel;
    } while (++tap < taps.count);
    return sum;
}

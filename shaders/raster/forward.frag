// Multi-view rendering, one pass a view: shade each fragment that passes the depth test so far.
// Row 0 of the raster is the top row, so screen y derivatives run downward as rows do.

#include "common/frame.glsl"
#include "common/shading.glsl"

in vec3 p_display;
in vec3 normal_world;
in vec4 uv01;
in vec4 color;
flat in uint material;

uniform mat4 turn_from_display;  // see Placement
uniform float eye_mm;

layout(location = 0) out vec4 radiance;

const float ROUNDING = 5e-7;  // of interpolated coordinates, relative

// Changes that are along one line but for rounding are made so.
Footprint footprint(vec2 uv) {
    vec2 dx = dFdx(uv), dy = dFdy(uv);
    float lost = ROUNDING * max(abs(uv.x), abs(uv.y));
    if (abs(dx.x * dy.y - dx.y * dy.x) <= lost * (length(dx) + length(dy))) {
        vec2 longer = dot(dx, dx) > dot(dy, dy) ? dx : dy;
        vec2 along = longer * inversesqrt(max(1e-30, dot(longer, longer)));
        dx = along * dot(along, dx);
        dy = along * dot(along, dy);
    }
    return Footprint(uv, dx, dy, ONE_VIEW);
}

void main() {
    Surface surface;
    mat3 turn = mat3(turn_from_display);
    surface.to_eye = turn * (vec3(eye_mm, 0.0, frame.distance_mm) - p_display);
    surface.place = turn * p_display;
    surface.normal = normal_world;
    surface.dp_dx = turn * dFdx(p_display);
    surface.dp_dy = turn * dFdy(p_display);
    surface.uv0 = footprint(uv01.xy);
    surface.uv1 = footprint(uv01.zw);
    surface.color = color;
    surface.material = material;
    surface.back = !gl_FrontFacing;

    radiance = shade(surface);
    if (ALPHA_TESTED != 0) {
        float alpha = ALPHA_RULE == LOD_RULE ? radiance.a : base_color_of(surface, ALPHA_RULE).a;
        if (alpha < alpha_cutoff(material)) discard;
    }
    if (BLENDED == 0) radiance.a = 1.0;
}

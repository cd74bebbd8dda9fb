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

// By what interpolation loses of coordinates.
bool on_a_line(vec2 uv, vec2 dx, vec2 dy) {
    vec2 lengths = abs(dx) + abs(dy);
    return abs(dx.x * dy.y - dx.y * dy.x) <= UV_ROUNDING * max(abs(uv.x), abs(uv.y)) * (lengths.x + lengths.y);
}

void main() {
    Surface surface;
    mat3 turn = mat3(turn_from_display);
    surface.to_eye = turn * (vec3(eye_mm, 0.0, frame.distance_mm) - p_display);
    surface.place = turn * p_display;
    surface.normal = normal_world;
    surface.dp_dx = turn * dFdx(p_display);
    surface.dp_dy = turn * dFdy(p_display);
    surface.uv0 = Footprint(uv01.xy, dFdx(uv01.xy), dFdy(uv01.xy), ONE_VIEW);
    surface.uv1 = Footprint(uv01.zw, dFdx(uv01.zw), dFdy(uv01.zw), ONE_VIEW);
    surface.line0 = on_a_line(surface.uv0.uv, surface.uv0.dx, surface.uv0.dy);
    surface.line1 = on_a_line(surface.uv1.uv, surface.uv1.dx, surface.uv1.dy);
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

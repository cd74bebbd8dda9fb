// What the fragments of all views share. Row 0 of the raster is the top row, so screen y derivatives run
// downward as rows do.

#include "common/shading.glsl"
#include "raster/corner.glsl"
#include "raster/views.glsl"

in Corner CORNER corner;

uniform mat4 turn_from_display;  // see Placement
uniform uint first_triangle;     // global id of the draw's first

// Drops what lies in the parts of other views, where nothing before has clipped it.
void keep_to_part() {
    if (FRAGMENT_CLIPPING == 0) return;
    vec4 box = raster_views[corner.view].box;
    if (any(lessThan(gl_FragCoord.xy, box.xy)) || any(greaterThan(gl_FragCoord.xy, box.zw))) discard;
}

// By what interpolation loses of coordinates.
bool on_a_line(vec2 uv, vec2 dx, vec2 dy) {
    vec2 lengths = abs(dx) + abs(dy);
    return abs(dx.x * dy.y - dx.y * dy.x) <= UV_ROUNDING * max(abs(uv.x), abs(uv.y)) * (lengths.x + lengths.y);
}

Surface fragment_surface() {
    vec2 uv0 = corner.uv01.xy, uv1 = corner.uv01.zw;
    Surface surface;
    mat3 turn = mat3(turn_from_display);
    surface.to_eye = turn * (corner.eye - corner.p_display);
    surface.place = turn * corner.p_display;
    surface.normal = corner.normal_world;
    surface.dp_dx = turn * dFdx(corner.p_display);
    surface.dp_dy = turn * dFdy(corner.p_display);
    surface.uv0 = Footprint(uv0, dFdx(uv0), dFdy(uv0), ONE_VIEW);
    surface.uv1 = Footprint(uv1, dFdx(uv1), dFdy(uv1), ONE_VIEW);
    surface.line0 = on_a_line(surface.uv0.uv, surface.uv0.dx, surface.uv0.dy);
    surface.line1 = on_a_line(surface.uv1.uv, surface.uv1.dx, surface.uv1.dy);
    surface.color = corner.color;
    surface.material = corner.material;
    surface.back = !gl_FrontFacing;
    return surface;
}

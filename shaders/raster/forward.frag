// Multi-view rendering, one pass a view: shade each fragment that passes the depth test so far.
// Row 0 of the raster is the top row, so screen y derivatives run downward as rows do.

#include "common/frame.glsl"
#include "common/shading.glsl"

in vec3 p_world;
in vec3 normal_world;
in vec4 uv01;
in vec4 color;
flat in uint material;

uniform vec3 eye_world;

layout(location = 0) out vec4 radiance;

void main() {
    Surface surface;
    surface.p_world = p_world;
    surface.normal = normal_world;
    surface.dp_dx = dFdx(p_world);
    surface.dp_dy = dFdy(p_world);
    surface.uv0 = Footprint(uv01.xy, dFdx(uv01.xy), dFdy(uv01.xy));
    surface.uv1 = Footprint(uv01.zw, dFdx(uv01.zw), dFdy(uv01.zw));
    surface.color = color;
    surface.material = material;
    surface.back = !gl_FrontFacing;

    radiance = shade(surface, eye_world);
    if (ALPHA_TESTED != 0 && radiance.a < alpha_cutoff(material)) discard;
    if (BLENDED == 0) radiance.a = 1.0;
}

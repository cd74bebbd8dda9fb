// A triangle in one view of the pass, unless that cannot see it.

#include "common/facing.glsl"
#include "raster/corner.glsl"
#include "raster/place.glsl"

in Corner CORNER corners[];
out Corner CORNER corner;

uniform int views;  // of the pass
uniform uint facing;

bool beyond(vec3 sides) {
    return max(sides.x, max(sides.y, sides.z)) < 0.0;
}

// Whether all corners lie beyond one side of the frustum.
bool outside(RasterView view) {
    mat3x4 clip;
    for (int i = 0; i < 3; i++) clip[i] = view.clip_from_display * vec4(corners[i].p_display, 1.0);
    vec3 x = vec3(clip[0].x, clip[1].x, clip[2].x), y = vec3(clip[0].y, clip[1].y, clip[2].y);
    vec3 z = vec3(clip[0].z, clip[1].z, clip[2].z), w = vec3(clip[0].w, clip[1].w, clip[2].w);
    return beyond(w + x) || beyond(w - x) || beyond(w + y) || beyond(w - y) || beyond(w + z);
}

bool turned_away(RasterView view) {
    vec3 a = corners[0].p_display;
    vec3 normal = cross(corners[1].p_display - a, corners[2].p_display - a);
    return !faces(facing, dot(normal, view.eye.xyz - a));
}

void emit_view(int index) {
    int view = first_view + index;
    if (FRUSTUM_CULLING != 0 && outside(raster_views[view])) return;
    if (BACKFACE_CULLING != 0 && turned_away(raster_views[view])) return;
    for (int i = 0; i < 3; i++) {
        corner.p_display = corners[i].p_display;
        corner.normal_world = corners[i].normal_world;
        corner.uv01 = corners[i].uv01;
        corner.color = corners[i].color;
        corner.material = corners[i].material;
        corner.eye = raster_views[view].eye.xyz;
        corner.view = view;
        place(view, corners[i].p_display);
        if (LAYERED != 0) gl_Layer = index;
        gl_PrimitiveID = gl_PrimitiveIDIn;
        EmitVertex();
    }
    EndPrimitive();
}

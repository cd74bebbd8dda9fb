// A point in a view's part of the target. CLIPS distances are used: those to the window's sides, since the
// raster is a parallelogram around the window when views follow the lenses; and, where clip planes keep the
// parts of a target apart, those to the sides of the view's own part.

#include "raster/views.glsl"

uniform int first_view;  // of the pass

out float gl_ClipDistance[CLIPS];

void place(int view, vec3 p_display) {
    vec4 p = vec4(p_display, 1.0), clip = raster_views[view].clip_from_display * p;
    vec4 part = raster_views[view].part;
    gl_Position = vec4(clip.xy * part.xy + clip.w * part.zw, clip.zw);
    gl_ClipDistance[0] = dot(raster_views[view].left, p);
    gl_ClipDistance[1] = dot(raster_views[view].right, p);
    vec4 within = vec4(clip.w + clip.xy, clip.w - clip.xy);
    for (int i = 2; i < CLIPS; i++) gl_ClipDistance[i] = within[i - 2];
}

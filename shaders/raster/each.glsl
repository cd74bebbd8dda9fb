// A vertex in one view of the pass.

#include "raster/vertex.glsl"
#include "raster/place.glsl"

void place_corner(int view) {
    load_corner();
    corner.eye = raster_views[view].eye.xyz;
    corner.view = view;
    place(view, corner.p_display);
}

// The views of a raster, and where in its target each lies.

#include "layout/RasterView"

layout(std430) readonly restrict buffer RasterViews { RasterView raster_views[]; };

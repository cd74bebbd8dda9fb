// A row of points, read back: a triangle's slice by a window row, ready for all views. Its points are
// the cells that it touches of the columns of the eye that sees the triangle densest (density.glsl).
// Points own half-open cells, so that in every view their footprints, cut to the triangle, abut, and
// the row's footprint is the one interval between the slice's ends.

#include "common/slices.glsl"
#include "layout/Work"

layout(std430) readonly restrict buffer PointRows { PointRow point_rows[]; };
layout(std430) readonly restrict buffer WorkBlock { Work work[]; };

uniform int window;

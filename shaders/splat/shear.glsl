// Splat a row of points into a view by the shear identity: what its points cover there, cut to the
// triangle (the inside-triangle test of Gavane and Watson 2023, section 3.3), is an interval of columns
// whose ends move linearly with the eye.
// In: PointRows, Work, Eyes (columns); the batch where alpha counts. Out: what visit() writes.

#include "common/triangles.glsl"
#include "common/slices.glsl"
#include "common/alpha.glsl"
#include "splat/interval.glsl"

layout(std430) readonly restrict buffer Eyes { float eyes[]; };  // in columns, view 0 first

void splat_row(PointRow points, bool real, int view, float eye) {
    Interval seen = interval_of(points, eye);
    if (!real || view >= frame.views) seen.end = seen.column;
    if (seen.faced) tried(uint(max(seen.end - seen.column, 1)));
    splat_interval(points, seen, view, eye);
}

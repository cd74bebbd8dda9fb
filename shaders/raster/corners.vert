// Multi-view rendering with a geometry stage: a vertex before any view.
// In: the batch.

#include "raster/vertex.glsl"

void main() {
    load_corner();
}

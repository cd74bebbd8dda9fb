// Items are the rows of visible triangles, counted through; Work says which of them a window holds.

#include "layout/Span"
#include "layout/Visible"
#include "layout/Work"

layout(std430) readonly restrict buffer Spans { Span spans[]; };
layout(std430) readonly restrict buffer VisibleTriangles { Visible visible[]; };
layout(std430) readonly restrict buffer WorkBlock { Work work[]; };
layout(std430) readonly restrict buffer ItemStarts { uint item_starts[]; };  // see sample/compact.comp

uniform int window;

// Index of the visible triangle that holds an item: the last one that starts at or before it.
uint visible_at(uint item) {
    uint low = item_starts[item / ITEM_STEP], high = min(low + ITEM_STEP, work[window].visible);
    while (low + 1u < high) {
        uint middle = (low + high) / 2u;
        if (visible[middle].first_item <= item) low = middle;
        else high = middle;
    }
    return low;
}

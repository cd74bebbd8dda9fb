// The list of items (rows of visible triangles) and the part of it that a work group takes.

#include "layout/Span"
#include "layout/Visible"
#include "layout/Work"

layout(std430) readonly restrict buffer Spans { Span spans[]; };
layout(std430) readonly restrict buffer VisibleTriangles { Visible visible[]; };
layout(std430) readonly restrict buffer WorkBlock { Work work; };
layout(std430) readonly restrict buffer Eyes { float eyes[]; };  // in columns, view 0 first

uint first_item() {
    return (gl_WorkGroupID.y * GROUPS_ACROSS + gl_WorkGroupID.x) * GROUP_ITEMS;
}

// Index of the visible triangle that holds an item: the last one that starts at or before it.
uint visible_at(uint item) {
    uint low = 0u, high = work.visible;
    while (low + 1u < high) {
        uint middle = (low + high) / 2u;
        if (visible[middle].first_item <= item) low = middle;
        else high = middle;
    }
    return low;
}

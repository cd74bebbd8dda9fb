// The pixels of the listed blocks, and the triangles that their words name. A work group takes GROUP_BLOCKS blocks,
// BLOCKS_ABREAST at a time, a lane a column: software devices pay for the start of every vector of lanes.
// Needs: the Frame block.

#include "layout/BlockWork"

// Winners, each WORD_STRIDE words from the one before. Only share/mark.comp writes them.
layout(std430) restrict buffer Words { uint words[]; };
uniform usamplerBuffer Blocks;  // a texel a Block
layout(std430) readonly restrict buffer BlockWorkBlock { BlockWork block_work; };

// A pixel of the views, or of column −1 beyond its row; its eye and how far its row is moved, in columns.
struct Listed {
    ivec3 pixel;  // column, row of the band, view
    float eye;
    float row_offset;
};

// What a pixel shows. Nothing: background, or a triangle of another batch.
struct Visible {
    ivec3 pixel;
    bool nothing;
    uint triangle;
};

// Index in the view buffers.
uint band_pixel(ivec3 pixel) {
    return uint((pixel.y * frame.views + pixel.z) * frame.columns + pixel.x);
}

// Places in the list that this invocation takes, every BLOCKS_ABREASTth from the first on, and where they end.
uvec2 own_places() {
    uint first = (gl_WorkGroupID.y * GROUPS_ACROSS + gl_WorkGroupID.x) * GROUP_BLOCKS;
    return uvec2(first + gl_LocalInvocationID.y, min(first + GROUP_BLOCKS, block_work.blocks));
}

// This invocation's pixel of a block.
Listed listed_pixel(uint place) {
    uvec4 block = texelFetch(Blocks, int(place));
    int column = int((block.x & 0xFFFu) * BLOCK + gl_LocalInvocationID.x);
    if (column >= frame.columns) column = -1;
    return Listed(ivec3(column, int(block.x >> 12), int(block.y)), uintBitsToFloat(block.z), uintBitsToFloat(block.w));
}

Visible visible_pixel(uint place) {
    Visible seen;
    seen.pixel = listed_pixel(place).pixel;
    seen.nothing = seen.pixel.x < 0;
    if (seen.nothing) return seen;
    seen.triangle = words[WORD_STRIDE * band_pixel(seen.pixel)] - frame.triangle_base;
    seen.nothing = seen.triangle >= frame.triangles;
    return seen;
}

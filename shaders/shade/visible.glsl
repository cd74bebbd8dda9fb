// The pixels of the listed blocks, and the triangles that their words name.
// Needs: the Frame block.

#include "layout/BlockWork"

// Winners, each WORD_STRIDE words from the one before.
#ifdef WORDS_WRITTEN
layout(std430) restrict buffer Words { uint words[]; };
#else
layout(std430) readonly restrict buffer Words { uint words[]; };
#endif
layout(std430) readonly restrict buffer Blocks { uint blocks[]; };  // see shade/blocks.comp
layout(std430) readonly restrict buffer BlockWorkBlock { BlockWork block_work; };

// A pixel of the views and what it shows. Nothing: background, or a triangle of another batch.
struct Visible {
    ivec3 pixel;  // column, row of the band, view
    bool nothing;
    uint triangle;
};

// Index in the view buffers.
uint band_pixel(ivec3 pixel) {
    return uint((pixel.y * frame.views + pixel.z) * frame.columns + pixel.x);
}

// This invocation's pixel, or -1 beyond the list.
ivec3 listed_pixel() {
    uint place = (gl_WorkGroupID.y * GROUPS_ACROSS + gl_WorkGroupID.x) * GROUP_BLOCKS + gl_LocalInvocationID.y;
    uint block = place < block_work.blocks ? blocks[place] : 0u;
    int column = int((block & 0xFFFu) * BLOCK + gl_LocalInvocationID.x);
    if (place >= block_work.blocks || column >= frame.columns) return ivec3(-1);
    return ivec3(column, int(block >> 22), int(block >> 12 & 0x3FFu));
}

Visible visible_pixel() {
    Visible seen;
    seen.pixel = listed_pixel();
    seen.nothing = seen.pixel.x < 0;
    if (seen.nothing) return seen;
    seen.triangle = words[WORD_STRIDE * band_pixel(seen.pixel)] - frame.triangle_base;
    seen.nothing = seen.triangle >= frame.triangles;
    return seen;
}

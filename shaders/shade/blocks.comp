// The blocks of BLOCK columns that show triangles of a batch: a software device runs all that a branch
// skips, and backgrounds are large. The order of the list varies; what it leads to does not.
// In: Words, Eyes, RowOffsets. Out: Blocks, BlockWork, and which triangles are shown.

layout(local_size_x = 64) in;

#include "common/frame.glsl"
#include "layout/Block"
#include "layout/BlockWork"

layout(std430) readonly restrict buffer Words { uint words[]; };
layout(std430) readonly restrict buffer Eyes { float eyes[]; };
layout(std430) readonly restrict buffer RowOffsets { float row_offsets[]; };
layout(std430) writeonly restrict buffer Blocks { Block blocks[]; };
layout(std430) restrict buffer BlockWorkBlock { BlockWork block_work; };
layout(std430) writeonly restrict buffer TriangleTracks { uvec2 triangle_tracks[]; };  // where MARK_TRIANGLES is 1

uniform uint first_block;   // of all of the band, and how many
uniform uint block_count;
uniform uint row_blocks;    // of one row of one view
uniform uint groups_across; // work groups of the dispatch along x

void main() {
    uint block = gl_GlobalInvocationID.y * groups_across * 64u + gl_GlobalInvocationID.x;
    if (block >= block_count) return;
    block += first_block;
    uint line = block / row_blocks, first = (block % row_blocks) * BLOCK;
    uint end = min(first + BLOCK, uint(frame.columns));
    bool any_here = false;
    // Background is no triangle of any batch, since ids end far below it.
    for (uint column = first; column < end; column++) {
        uint triangle = words[WORD_STRIDE * (line * uint(frame.columns) + column)] - frame.triangle_base;
        if (triangle >= frame.triangles) continue;
        any_here = true;
        if (MARK_TRIANGLES != 0) triangle_tracks[triangle].x = 1u;
    }
    if (!any_here) return;
    uint place = atomicAdd(block_work.blocks, 1u), group = place / GROUP_BLOCKS;
    uint row = line / uint(frame.views), view = line % uint(frame.views);
    blocks[place] = Block(row << 12 | block % row_blocks, view, eyes[view], row_offsets[frame.band_first + int(row)]);
    atomicMax(block_work.groups_x, min(group + 1u, GROUPS_ACROSS));
    atomicMax(block_work.groups_y, group / GROUPS_ACROSS + 1u);
}

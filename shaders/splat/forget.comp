// Forget the winners and keep their depths, where both share 64 bits.
// In, out: Winners, as pairs of id and depth.

layout(local_size_x = 64) in;

layout(std430) restrict buffer Winners { uvec2 winners[]; };

uniform uint pixels;
uniform uint groups_across;

void main() {
    uint pixel = (gl_WorkGroupID.y * groups_across + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
    if (pixel < pixels) winners[pixel].x = NO_TRIANGLE;
}

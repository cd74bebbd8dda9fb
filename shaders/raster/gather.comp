// Ids of a raster's target → winners as shading reads them, [row of the band][view][column].
// In: id_images. Out: Words.

layout(local_size_x = 64) in;

uniform usampler2DArray id_images;

layout(std430) writeonly restrict buffer Words { uint words[]; };

uniform ivec3 view_size;  // columns, rows of the band, views
uniform ivec3 parts;      // across a layer, of a layer, rows of each

void main() {
    int column = int(gl_GlobalInvocationID.x), row = int(gl_GlobalInvocationID.y), view = int(gl_GlobalInvocationID.z);
    if (column >= view_size.x) return;
    int part = view % parts.y;
    ivec2 corner = ivec2(part % parts.x * view_size.x, part / parts.x * parts.z);
    words[(row * view_size.z + view) * view_size.x + column] =
        texelFetch(id_images, ivec3(corner + ivec2(column, row), view / parts.y), 0).x;
}

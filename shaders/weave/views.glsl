// Pixels of view_images, [view, row of the band, column]: linear light, codes where ENCODED is 1, or pictures in sRGB where
// PICTURES is 1, which only fetches decode. A software device takes two thirds of a fetch's time to load.

#if PICTURES
uniform sampler2DArray view_images;
vec4 view_pixel(ivec3 at) {
    return texelFetch(view_images, at, 0);
}
#elif ENCODED
layout(rgba8, binding = 2) readonly uniform image2DArray loaded_views;
vec4 view_pixel(ivec3 at) {
    return imageLoad(loaded_views, at);
}
#else
layout(rgba16f, binding = 2) readonly uniform image2DArray loaded_views;
vec4 view_pixel(ivec3 at) {
    return imageLoad(loaded_views, at);
}
#endif

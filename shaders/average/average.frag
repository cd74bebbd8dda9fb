// One view's pixels as the mean of EYES eyes of TIMES × TIMES pixels each, in linear light.
// In: view_images [eye, row, column]. Out: a pixel of the layer in use.

layout(rgba16f, binding = 0) readonly uniform image2DArray view_images;
uniform int first_eye;

layout(location = 0) out vec4 mean;

void main() {
    ivec2 corner = ivec2(gl_FragCoord.xy) * TIMES;
    vec4 total = vec4(0.0);
    for (int eye = 0; eye < EYES; eye++) {
        for (int y = 0; y < TIMES; y++) {
            for (int x = 0; x < TIMES; x++) {
                total += imageLoad(view_images, ivec3(corner + ivec2(x, y), first_eye + eye));
            }
        }
    }
    mean = total / float(EYES * TIMES * TIMES);
}

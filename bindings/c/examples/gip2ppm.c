/* Shows the size of a picture, and writes it as a PPM: gip2ppm PICTURE.gip PICTURE.ppm */
#include <gip.h>
#include <stdio.h>
#include <stdlib.h>

int main(int argc, char **argv)
{
    gip_view view = gip_view_default();
    gip_output output = gip_output_default();
    gip_decoder *decoder;
    FILE *in = argc == 3 ? fopen(argv[1], "rb") : NULL, *out;
    unsigned char piece[4096], *pixels;
    size_t size;

    if (!in || gip_decoder_new(NULL, &decoder))
        return fprintf(stderr, "usage: gip2ppm PICTURE.gip PICTURE.ppm\n"), 1;
    while ((size = fread(piece, 1, sizeof piece, in)) > 0)
        if (gip_decoder_feed(decoder, piece, size, NULL))
            break;
    view.color = GIP_COLOR_RGB;
    view.samples = GIP_SAMPLES_U8;
    if (gip_decoder_finish(decoder, 0))
        fprintf(stderr, "%s: %s\n", argv[1], gip_last_error()); /* What has arrived can be shown. */
    if (gip_output_size(decoder, &view, &output) || !(pixels = malloc(output.size))
        || gip_render(decoder, &view, pixels, 0, output.size))
        return fprintf(stderr, "%s: %s\n", argv[1], gip_last_error()), 1;
    printf("%s: %u x %u pixels\n", argv[1], (unsigned)output.width, (unsigned)output.height);
    if (!(out = fopen(argv[2], "wb")))
        return perror(argv[2]), 1;
    fprintf(out, "P6\n%u %u\n255\n", (unsigned)output.width, (unsigned)output.height);
    size = fwrite(pixels, 1, output.size, out);
    gip_decoder_free(decoder);
    free(pixels);
    return fclose(out) || size != output.size;
}

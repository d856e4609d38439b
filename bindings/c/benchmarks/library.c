/*
 * The C library, for compare.py: see native.rs, which does the same without it.
 *
 *     library PICTURE.ppm
 */

#include <gip.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static void check(gip_status status)
{
    if (status != GIP_STATUS_OK) {
        fprintf(stderr, "%s\n", gip_last_error());
        exit(EXIT_FAILURE);
    }
}

static void decode(gip_buffer file)
{
    gip_output output = gip_output_default();
    gip_decoder *decoder;
    void *samples;
    check(gip_decoder_open(file.data, file.size, NULL, &decoder));
    check(gip_output_size(decoder, NULL, &output));
    samples = malloc(output.size);
    check(gip_render(decoder, NULL, samples, 0, output.size));
    free(samples);
    gip_decoder_free(decoder);
}

static gip_buffer encode(const gip_source *source)
{
    gip_encode_options options = gip_encode_options_default();
    gip_buffer file;
    options.target = GIP_TARGET_BITS_PER_PIXEL;
    options.value = 0.5;
    options.effort = 1;
    check(gip_encode(source, &options, &file, NULL));
    return file;
}

int main(int count, char **arguments)
{
    FILE *picture = count == 2 ? fopen(arguments[1], "rb") : NULL;
    gip_source source = gip_source_default();
    unsigned width, height;
    unsigned char *pixels;
    gip_buffer file;
    char line[16];
    if (!picture || fscanf(picture, "P6 %u %u 255", &width, &height) != 2 || fgetc(picture) != '\n') {
        fprintf(stderr, "usage: library PICTURE.ppm\n");
        return EXIT_FAILURE;
    }
    source.width = width;
    source.height = height;
    source.color = GIP_COLOR_RGB;
    source.samples = GIP_SAMPLES_U8;
    source.size = (size_t)3 * width * height;
    pixels = malloc(source.size);
    if (!pixels || fread(pixels, 1, source.size, picture) != source.size) {
        fprintf(stderr, "the picture is cut off\n");
        return EXIT_FAILURE;
    }
    source.pixels = pixels;
    file = encode(&source);
    while (fgets(line, sizeof line, stdin)) {
        struct timespec start, end;
        clock_gettime(CLOCK_MONOTONIC, &start);
        if (strcmp(line, "decode\n") == 0) {
            decode(file);
        } else {
            gip_buffer again = encode(&source);
            gip_buffer_free(&again);
        }
        clock_gettime(CLOCK_MONOTONIC, &end);
        printf("%.0f\n", (double)(end.tv_sec - start.tv_sec) * 1e9 + (double)(end.tv_nsec - start.tv_nsec));
        fflush(stdout);
    }
    gip_buffer_free(&file);
    free(pixels);
    fclose(picture);
    return 0;
}

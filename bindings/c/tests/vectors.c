/*
 * Decodes all test vectors of the specification in the ways of this library, and compares what comes out
 * with their index.
 *
 *     vectors spec/vectors
 */

#include "test.h"

/* The rendering that a line of the index describes. Returns 0 if it describes none. */
static int parse_view(const char *rendering, gip_view *view)
{
    unsigned a, b, c, d, e, f;
    char name[16];
    *view = gip_view_default();
    if (strcmp(rendering, "whole") == 0) {
        return 1;
    }
    if (strcmp(rendering, "without texture") == 0) {
        view->flags = GIP_VIEW_NO_TEXTURE;
        return 1;
    }
    if (sscanf(rendering, "size %ux%u, region %ux%u at %u,%u", &a, &b, &c, &d, &e, &f) == 6) {
        view->width = a;
        view->height = b;
        view->region_width = c;
        view->region_height = d;
        view->region_x = e;
        view->region_y = f;
        return 1;
    }
    if (sscanf(rendering, "size %ux%u", &a, &b) == 2) {
        view->width = a;
        view->height = b;
        return 1;
    }
    if (sscanf(rendering, "region %ux%u at %u,%u", &a, &b, &c, &d) == 4) {
        view->region_width = a;
        view->region_height = b;
        view->region_x = c;
        view->region_y = d;
        return 1;
    }
    if (sscanf(rendering, "first %u", &a) == 1) {
        view->gaussians = a;
        return 1;
    }
    if (sscanf(rendering, "as %15s", name) == 1) {
        view->color = strcmp(name, "GrayAlpha") == 0 ? GIP_COLOR_GRAY_ALPHA
                      : strcmp(name, "Rgb") == 0     ? GIP_COLOR_RGB
                                                     : GIP_COLOR_RGBA;
        return 1;
    }
    return 0;
}

/* The checksum of a rendering: of its samples, those of 16 bits with their more significant byte first. */
static uint32_t checksum(gip_decoder *decoder, const gip_view *view)
{
    gip_output output = gip_output_default();
    uint8_t *samples;
    uint32_t crc;
    size_t i;
    OK(gip_output_size(decoder, view, &output));
    CHECK(output.size == output.row_size * output.height);
    samples = (uint8_t *)allocate(output.size);
    OK(gip_render(decoder, view, samples, output.row_size, output.size));
    if (output.samples == GIP_SAMPLES_U16) {
        for (i = 0; i + 1 < output.size; i += 2) {
            uint16_t sample;
            memcpy(&sample, samples + i, 2);
            samples[i] = (uint8_t)(sample >> 8);
            samples[i + 1] = (uint8_t)sample;
        }
    }
    crc = crc32_of(0, samples, output.size);
    free(samples);
    return crc;
}

/* Feeds a file in pieces. Returns how that ends. */
static gip_status feed(gip_decoder *decoder, const uint8_t *file, size_t size, size_t piece)
{
    size_t at, used;
    for (at = 0; at < size; at += piece) {
        size_t length = size - at < piece ? size - at : piece;
        gip_status status = gip_decoder_feed(decoder, file + at, length, &used);
        if (status != GIP_STATUS_OK) {
            CHECK(used == 0);
            EXPECT(status, gip_decoder_feed(decoder, file, 1, NULL));
            EXPECT(status, gip_decoder_finish(decoder, 0));
            return status;
        }
        CHECK(used <= length);
    }
    return gip_decoder_finish(decoder, 0);
}

/* A valid file, in every way. */
static void check_rendering(const uint8_t *file, size_t size, gip_view view, uint32_t crc)
{
    gip_info info = gip_info_default();
    gip_decoder *fed, *opened;
    size_t pieces[] = {1, 7, 1 << 20};
    size_t i;
    CHECK(gip_is_gip(file, size));
    for (i = 0; i < sizeof pieces / sizeof *pieces; i++) {
        OK(gip_decoder_new(NULL, &fed));
        EXPECT(GIP_STATUS_NEED_MORE, gip_decoder_info(fed, &info));
        OK(feed(fed, file, size, pieces[i]));
        OK(gip_decoder_info(fed, &info));
        CHECK(info.is_complete && info.decoded_gaussians == info.gaussians);
        CHECK(info.decoded_layers == info.layers);
        CHECK(checksum(fed, &view) == crc);
        gip_decoder_free(fed);
    }
    for (view.threads = 0; view.threads <= 2; view.threads += 2) {
        OK(gip_decoder_open(file, size, NULL, &opened));
        CHECK(checksum(opened, &view) == crc);
        OK(gip_decoder_finish(opened, view.threads));
        CHECK(checksum(opened, &view) == crc);
        gip_decoder_free(opened);
    }
}

/* The status of a kind of error. */
static gip_status status_of(const char *kind)
{
    return strncmp(kind, "signature", 9) == 0     ? GIP_STATUS_SIGNATURE
           : strncmp(kind, "malformed", 9) == 0   ? GIP_STATUS_MALFORMED
           : strncmp(kind, "unsupported", 11) == 0 ? GIP_STATUS_UNSUPPORTED
                                                  : GIP_STATUS_UNEXPECTED_END;
}

/* A file that is refused, by what the index says: "malformed L; 2 kept". */
static void check_refusal(const uint8_t *file, size_t size, const char *result)
{
    gip_info info = gip_info_default();
    gip_status expected = status_of(result), status;
    const char *kept = strchr(result, ';');
    char chunk[8] = "", text[32];
    gip_decoder *decoder;
    size_t piece;
    CHECK(kept);
    if (sscanf(result, "malformed %7[^;]", chunk) == 1
        || sscanf(result, "unsupported %7[^;]", chunk) == 1
        || sscanf(result, "unexpected end %7[^;]", chunk) == 1) {
        snprintf(text, sizeof text, "chunk %s", chunk);
    } else {
        text[0] = '\0';
    }
    for (piece = 1; piece <= size; piece += size - 1) {
        OK(gip_decoder_new(NULL, &decoder));
        EXPECT(expected, feed(decoder, file, size, piece));
        EXPECT(expected, gip_decoder_finish(decoder, 0));
        CHECK(strstr(gip_last_error(), text));
        status = gip_decoder_info(decoder, &info);
        CHECK(status == GIP_STATUS_OK || status == GIP_STATUS_NEED_MORE);
        if (status == GIP_STATUS_OK) {
            CHECK(info.decoded_gaussians == (uint32_t)atoi(kept + 2));
            /* What has arrived can be shown. */
            checksum(decoder, NULL);
        } else {
            CHECK(atoi(kept + 2) == 0);
            EXPECT(GIP_STATUS_NEED_MORE, gip_render(decoder, NULL, chunk, 0, sizeof chunk));
        }
        gip_decoder_free(decoder);
        if (size == 1) {
            break;
        }
    }
    status = gip_decoder_open(file, size, NULL, &decoder);
    if (status == GIP_STATUS_OK) {
        gip_output output = gip_output_default();
        void *samples;
        OK(gip_output_size(decoder, NULL, &output));
        samples = allocate(output.size);
        EXPECT(expected, gip_render(decoder, NULL, samples, 0, output.size));
        EXPECT(expected, gip_render(decoder, NULL, samples, 0, output.size));
        free(samples);
        status = gip_decoder_finish(decoder, 0);
    } else {
        CHECK(!decoder);
    }
    CHECK(status == expected && strstr(gip_last_error(), text));
    gip_decoder_free(decoder);
}

/* Which chunks are skipped: "cICP cICP". */
static void check_skipped(const uint8_t *file, size_t size, const char *chunks)
{
    gip_info info = gip_info_default();
    gip_decoder *decoder;
    char expected[32], chunk[8];
    int length;
    uint32_t count = 0;
    OK(gip_decoder_new(NULL, &decoder));
    OK(feed(decoder, file, size, size));
    while (sscanf(chunks, "%7s%n", chunk, &length) == 1) {
        const char *text = gip_decoder_skipped(decoder, count);
        snprintf(expected, sizeof expected, "chunk %s is skipped: ", chunk);
        CHECK(text && strncmp(text, expected, strlen(expected)) == 0);
        chunks += length;
        count++;
    }
    OK(gip_decoder_info(decoder, &info));
    CHECK(info.skipped == count && !gip_decoder_skipped(decoder, count));
    gip_decoder_free(decoder);
}

/* The next column of a line, without the tab behind it. */
static char *column(char **line)
{
    char *start = *line, *tab = strchr(start, '\t');
    if (tab) {
        *tab = '\0';
        *line = tab + 1;
    }
    return start;
}

int main(int count, char **arguments)
{
    uint8_t *index;
    char *rest;
    size_t length;
    unsigned rendered = 0, refused = 0, skipping = 0;
    CHECK(count == 2);
    index = read_file(arguments[1], "index.tsv", &length);
    CHECK(length && index[length - 1] == '\n');
    index[length - 1] = '\0';
    rest = strchr((char *)index, '\n');
    while (rest) {
        char *line = rest + 1, *name, *rendering, *result;
        gip_view view;
        size_t size;
        uint8_t *file;
        char *end = strchr(line, '\n');
        if (end) {
            *end = '\0';
        }
        rest = end;
        name = column(&line);
        rendering = column(&line);
        result = column(&line);
        subject = name;
        file = read_file(arguments[1], name, &size);
        if (strcmp(rendering, "error") == 0) {
            check_refusal(file, size, result);
            refused++;
        } else if (strcmp(rendering, "skips") == 0) {
            check_skipped(file, size, result);
            skipping++;
        } else if (strcmp(rendering, "first 0") == 0) {
            /* 0 stands for all, here. */
        } else {
            CHECK(parse_view(rendering, &view));
            check_rendering(file, size, view, (uint32_t)strtoul(result, NULL, 16));
            rendered++;
        }
        free(file);
    }
    free(index);
    CHECK(rendered && refused && skipping);
    printf("vectors: %u renderings, %u refused, %u with skipped parts\n", rendered, refused, skipping);
    return 0;
}

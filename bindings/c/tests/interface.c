/*
 * The decoder's interface beyond test vectors: outputs of all types and shapes, metadata, and what is
 * refused.
 *
 *     interface spec/vectors
 */

#include <math.h>

#include "test.h"

static const char *folder;

static gip_decoder *open_vector(const char *name, uint8_t **file, size_t *size)
{
    gip_decoder *decoder;
    *file = read_file(folder, name, size);
    OK(gip_decoder_open(*file, *size, NULL, &decoder));
    return decoder;
}

static void versions(void)
{
    char text[32];
    CHECK(gip_abi_version() == GIP_ABI_VERSION);
    snprintf(text, sizeof text, "%d.%d.%d", GIP_VERSION_MAJOR, GIP_VERSION_MINOR, GIP_VERSION_PATCH);
    CHECK(strcmp(text, gip_version()) == 0);
    CHECK(gip_is_gip("\xC7GIP\r\n\x01\n", 8) == 1);
    CHECK(gip_is_gip("\xC7GIP\r\n\x02\n", 8) == 1);
    CHECK(gip_is_gip("\xC7GIP\r\n\x01\n", 7) == 0);
    CHECK(gip_is_gip("\x89PNG\r\n\x1A\n", 8) == 0);
    CHECK(gip_is_gip(NULL, 8) == 0 && gip_is_gip(NULL, 0) == 0);
}

/* Every type of samples, with and without padding, shows the same picture. */
static void samples(const char *name, uint32_t channels)
{
    gip_view view = gip_view_default();
    gip_output output = gip_output_default();
    uint8_t *file, *bytes;
    uint16_t *words, *padded;
    float *floats, *planes;
    size_t size, pixels, i, x, y, stride;
    gip_decoder *decoder = open_vector(name, &file, &size);
    OK(gip_output_size(decoder, NULL, &output));
    CHECK(output.color == channels && output.struct_size == sizeof output);
    pixels = (size_t)output.width * output.height;
    bytes = (uint8_t *)allocate(pixels * channels);
    words = (uint16_t *)allocate(pixels * channels * 2);
    floats = (float *)allocate(pixels * channels * 4);
    planes = (float *)allocate(pixels * channels * 4);
    view.samples = GIP_SAMPLES_U8;
    OK(gip_render(decoder, &view, bytes, 0, pixels * channels));
    view.samples = GIP_SAMPLES_U16;
    OK(gip_render(decoder, &view, words, 0, pixels * channels * 2));
    view.samples = GIP_SAMPLES_F32;
    OK(gip_render(decoder, &view, floats, 0, pixels * channels * 4));
    view.samples = GIP_SAMPLES_F32_PLANES;
    OK(gip_output_size(decoder, &view, &output));
    CHECK(output.size == pixels * channels * 4 && output.row_size == (size_t)output.width * 4);
    OK(gip_render(decoder, &view, planes, 0, pixels * channels * 4));
    for (i = 0; i < pixels * channels; i++) {
        float clamped = floats[i] < 0 ? 0 : floats[i] > 1 ? 1 : floats[i];
        CHECK(floats[i] == planes[i % channels * pixels + i / channels]);
        CHECK(bytes[i] == (uint8_t)(clamped * 255 + 0.5f));
        CHECK(words[i] == (uint16_t)(clamped * 65535 + 0.5f));
    }

    /* Rows with padding, which remains as it is, in planes as well. */
    view.samples = GIP_SAMPLES_U16;
    stride = output.width * channels + 3;
    padded = (uint16_t *)allocate(stride * output.height * 2);
    memset(padded, 0x5A, stride * output.height * 2);
    OK(gip_render(decoder, &view, padded, stride * 2, stride * output.height * 2 - 6));
    for (y = 0; y < output.height; y++) {
        for (x = 0; x < stride; x++) {
            size_t row = output.width * channels;
            CHECK(padded[y * stride + x] == (x < row ? words[y * row + x] : 0x5A5A));
        }
    }
    free(padded);
    view.samples = GIP_SAMPLES_F32_PLANES;
    stride = (output.width + 1) * 4;
    padded = (uint16_t *)allocate(stride * output.height * channels);
    OK(gip_render(decoder, &view, padded, stride, stride * output.height * channels));
    for (y = 0; y < (size_t)output.height * channels; y++) {
        CHECK(memcmp((char *)padded + y * stride, planes + y * output.width, output.row_size) == 0);
    }
    free(padded);
    free(bytes);
    free(words);
    free(floats);
    free(planes);
    gip_decoder_free(decoder);
    free(file);
}

/* A picture with alpha over a background, for outputs without. */
static void composed(void)
{
    gip_view view = gip_view_default();
    gip_info info = gip_info_default();
    uint8_t *file, *with, *without;
    float *floats;
    size_t size, pixels, i, channel;
    gip_decoder *decoder = open_vector("rgba8.gip", &file, &size);
    OK(gip_decoder_info(decoder, &info));
    CHECK(info.color == GIP_COLOR_RGBA && info.depth == 8 && info.version == 1);
    pixels = (size_t)info.width * info.height;
    with = (uint8_t *)allocate(pixels * 4);
    without = (uint8_t *)allocate(pixels * 3);
    floats = (float *)allocate(pixels * 12);
    OK(gip_render(decoder, NULL, with, 0, pixels * 4));
    view.color = GIP_COLOR_RGB;
    view.background[0] = 65535;
    view.background[1] = 257 * 100;
    OK(gip_render(decoder, &view, without, 0, pixels * 3));
    view.samples = GIP_SAMPLES_F32;
    OK(gip_render(decoder, &view, floats, 0, pixels * 12));
    for (i = 0; i < pixels; i++) {
        for (channel = 0; channel < 3; channel++) {
            double alpha = with[4 * i + 3], behind = channel == 0 ? 255 : channel == 1 ? 100 : 0;
            double shown = (with[4 * i + channel] * alpha + behind * (255 - alpha)) / 255;
            CHECK(fabs(shown - without[3 * i + channel]) <= 0.5);
            CHECK(fabs(shown / 255 - floats[3 * i + channel]) < 0.01);
        }
    }
    /* Colours do not become gray. */
    view.color = GIP_COLOR_GRAY;
    EXPECT(GIP_STATUS_ARGUMENT, gip_render(decoder, &view, floats, 0, pixels * 12));
    gip_decoder_free(decoder);
    free(file);
    decoder = open_vector("gray-alpha8.gip", &file, &size);
    OK(gip_decoder_info(decoder, &info));
    view.samples = GIP_SAMPLES_U8;
    pixels = (size_t)info.width * info.height;
    OK(gip_render(decoder, &view, without, 0, pixels));
    view.color = GIP_COLOR_RGB;
    without = (uint8_t *)realloc(without, pixels * 3);
    CHECK(without);
    OK(gip_render(decoder, &view, without, 0, pixels * 3));
    gip_decoder_free(decoder);
    free(file);
    free(with);
    free(without);
    free(floats);
}

static void metadata(void)
{
    gip_metadata metadata = gip_metadata_default(), again = gip_metadata_default();
    gip_info info = gip_info_default();
    uint8_t *file;
    size_t size, i;
    gip_decoder *decoder = open_vector("metadata.gip", &file, &size);
    OK(gip_decoder_info(decoder, &info));
    CHECK(info.orientation >= 1 && info.orientation <= 8 && !info.is_complete);
    OK(gip_decoder_metadata(decoder, &metadata));
    CHECK(metadata.icc.size && metadata.exif.size && metadata.xmp.size && metadata.present == 0);
    CHECK(memcmp(metadata.exif.data, "II", 2) == 0 || memcmp(metadata.exif.data, "MM", 2) == 0);
    CHECK(metadata.text_count == 3);
    for (i = 0; i < 3; i++) {
        CHECK(*metadata.texts[i].keyword && metadata.texts[i].text);
    }
    OK(gip_decoder_metadata(decoder, &again));
    CHECK(again.icc.data == metadata.icc.data && again.texts == metadata.texts);
    gip_decoder_free(decoder);
    free(file);

    decoder = open_vector("cicp.gip", &file, &size);
    OK(gip_decoder_metadata(decoder, &metadata));
    CHECK(metadata.present
          == (GIP_METADATA_CICP | GIP_METADATA_MASTERING_DISPLAY | GIP_METADATA_CONTENT_LIGHT));
    CHECK(metadata.cicp.primaries == 9 && metadata.cicp.transfer == 16);
    CHECK(metadata.mastering_display.max_luminance > metadata.mastering_display.min_luminance);
    CHECK(metadata.content_light.max_content > 0);
    CHECK(!metadata.icc.data && !metadata.texts && metadata.text_count == 0);
    gip_decoder_free(decoder);
    free(file);

    /* Of a file that is cut off, what is there is told. */
    file = read_file(folder, "metadata.gip", &size);
    OK(gip_decoder_open(file, size - 1, NULL, &decoder));
    EXPECT(GIP_STATUS_UNEXPECTED_END, gip_decoder_metadata(decoder, &metadata));
    CHECK(metadata.text_count == 3);
    gip_decoder_free(decoder);

    /* The file may be gone when its decoder is freed. */
    OK(gip_decoder_open(file, size, NULL, &decoder));
    free(file);
    gip_decoder_free(decoder);
}

/* Layer after layer, as they arrive. */
static void progressive(void)
{
    gip_info info = gip_info_default();
    gip_gaussian gaussians[64];
    uint32_t least = 0, layers = 0, enough;
    uint8_t *file, *pixels;
    size_t size, at, used, copied, shown;
    gip_decoder *decoder;
    file = read_file(folder, "entropy-layers.gip", &size);
    file = (uint8_t *)realloc(file, size + 5);
    CHECK(file);
    memset(file + size, 0, 5);
    OK(gip_decoder_new(NULL, &decoder));
    for (at = 0; at < size; at++) {
        OK(gip_decoder_feed(decoder, file + at, 1, NULL));
        if (gip_decoder_info(decoder, &info) != GIP_STATUS_OK) {
            continue;
        }
        CHECK(info.decoded_gaussians >= least && info.decoded_layers >= layers);
        CHECK(info.decoded_gaussians <= info.gaussians && info.decoded_layers <= info.layers);
        if (info.decoded_layers > layers) {
            shown = (size_t)info.width * info.height * info.color * (info.depth / 8);
            pixels = (uint8_t *)allocate(shown);
            OK(gip_render(decoder, NULL, pixels, 0, shown));
            free(pixels);
        }
        least = info.decoded_gaussians;
        layers = info.decoded_layers;
    }
    CHECK(info.is_complete && layers == 4);
    OK(gip_decoder_feed(decoder, NULL, 0, &used));
    OK(gip_decoder_feed(decoder, file + size, 5, &used));
    CHECK(used == 0);
    OK(gip_decoder_finish(decoder, 1));
    OK(gip_decoder_gaussians_for(decoder, 4, 4, &enough));
    CHECK(enough == info.gaussians / 6);
    OK(gip_decoder_gaussians(decoder, 0, 64, gaussians, &copied));
    CHECK(copied == (info.gaussians < 64 ? info.gaussians : 64));
    CHECK(gaussians[0].cholesky[0] > 0 && gaussians[0].cholesky[2] > 0);
    OK(gip_decoder_gaussians(decoder, info.gaussians - 1, 64, gaussians, &copied));
    CHECK(copied == 1);
    OK(gip_decoder_gaussians(decoder, (size_t)-1, 64, NULL, &copied));
    CHECK(copied == 0);
    EXPECT(GIP_STATUS_ARGUMENT, gip_decoder_gaussians(decoder, 0, 1, NULL, &copied));
    gip_decoder_free(decoder);

    /* What follows the end is not the file's. */
    OK(gip_decoder_new(NULL, &decoder));
    OK(gip_decoder_feed(decoder, file, size + 5, &used));
    CHECK(used == size);
    gip_decoder_free(decoder);

    /* A preview reads the first layers alone, so that it does not see that the rest is missing. */
    OK(gip_decoder_open(file, size - 8, NULL, &decoder));
    {
        gip_view view = gip_view_default();
        gip_output output = gip_output_default();
        view.gaussians = 1;
        OK(gip_output_size(decoder, &view, &output));
        pixels = (uint8_t *)allocate(output.size);
        OK(gip_render(decoder, &view, pixels, 0, output.size));
        OK(gip_decoder_info(decoder, &info));
        CHECK(info.decoded_layers == 1);
        EXPECT(GIP_STATUS_UNEXPECTED_END, gip_render(decoder, NULL, pixels, 0, output.size));
        free(pixels);
    }
    gip_decoder_free(decoder);
    free(file);
}

static void limits(void)
{
    gip_limits limits = gip_limits_default();
    gip_view view = gip_view_default();
    gip_output output = gip_output_default();
    uint8_t *file;
    size_t size;
    gip_decoder *decoder;
    file = read_file(folder, "gray8.gip", &size);
    limits.max_width = 5;
    EXPECT(GIP_STATUS_LIMIT, gip_decoder_open(file, size, &limits, &decoder));
    CHECK(!decoder && strstr(gip_last_error(), "width"));
    OK(gip_decoder_new(&limits, &decoder));
    EXPECT(GIP_STATUS_LIMIT, gip_decoder_feed(decoder, file, size, NULL));
    gip_decoder_free(decoder);
    limits.max_width = 0;
    limits.max_pixels = 1000000;
    OK(gip_decoder_open(file, size, &limits, &decoder));
    view.width = view.height = 1001;
    EXPECT(GIP_STATUS_LIMIT, gip_output_size(decoder, &view, &output));
    view.height = 999;
    OK(gip_output_size(decoder, &view, &output));
    CHECK(output.width == 1001 && output.height == 999 && output.row_size == 1001);
    gip_decoder_free(decoder);
    free(file);
}

/* Null pointers, and numbers that are out of range. */
static void refused(void)
{
    gip_view view = gip_view_default();
    gip_info info = gip_info_default();
    gip_output output = gip_output_default();
    gip_limits limits = gip_limits_default();
    gip_metadata metadata = gip_metadata_default();
    gip_buffer buffer = {NULL, 0};
    uint32_t samples[4096], number;
    uint8_t *file;
    size_t size;
    gip_decoder *decoder, *fed;
    struct {
        gip_view view;
        size_t added;
    } later;

    decoder = open_vector("gray8.gip", &file, &size);
    OK(gip_decoder_new(NULL, &fed));
    EXPECT(GIP_STATUS_ARGUMENT, gip_decoder_new(NULL, NULL));
    EXPECT(GIP_STATUS_ARGUMENT, gip_decoder_open(file, size, NULL, NULL));
    EXPECT(GIP_STATUS_ARGUMENT, gip_decoder_feed(NULL, file, size, NULL));
    EXPECT(GIP_STATUS_ARGUMENT, gip_decoder_feed(fed, NULL, 1, NULL));
    EXPECT(GIP_STATUS_ARGUMENT, gip_decoder_feed(fed, file, (size_t)-1, NULL));
    EXPECT(GIP_STATUS_ARGUMENT, gip_decoder_feed(decoder, file, size, NULL));
    EXPECT(GIP_STATUS_ARGUMENT, gip_decoder_finish(NULL, 0));
    EXPECT(GIP_STATUS_ARGUMENT, gip_decoder_finish(decoder, 1025));
    EXPECT(GIP_STATUS_ARGUMENT, gip_decoder_info(NULL, &info));
    EXPECT(GIP_STATUS_ARGUMENT, gip_decoder_info(decoder, NULL));
    EXPECT(GIP_STATUS_ARGUMENT, gip_decoder_metadata(NULL, &metadata));
    EXPECT(GIP_STATUS_ARGUMENT, gip_decoder_metadata(decoder, NULL));
    EXPECT(GIP_STATUS_ARGUMENT, gip_decoder_gaussians_for(decoder, 1, 1, NULL));
    EXPECT(GIP_STATUS_ARGUMENT, gip_decoder_gaussians_for(NULL, 1, 1, &number));
    EXPECT(GIP_STATUS_NEED_MORE, gip_decoder_gaussians_for(fed, 1, 1, &number));
    /* A call that could never succeed needs no more of the file. */
    EXPECT(GIP_STATUS_ARGUMENT, gip_decoder_gaussians_for(fed, 1, 1, NULL));
    EXPECT(GIP_STATUS_ARGUMENT, gip_decoder_info(fed, NULL));
    EXPECT(GIP_STATUS_ARGUMENT, gip_output_size(fed, NULL, NULL));
    EXPECT(GIP_STATUS_ARGUMENT, gip_render(fed, NULL, NULL, 0, 0));
    EXPECT(GIP_STATUS_ARGUMENT, gip_output_size(NULL, NULL, &output));
    EXPECT(GIP_STATUS_ARGUMENT, gip_output_size(decoder, NULL, NULL));
    EXPECT(GIP_STATUS_NEED_MORE, gip_output_size(fed, NULL, &output));
    EXPECT(GIP_STATUS_ARGUMENT, gip_render(NULL, NULL, samples, 0, sizeof samples));
    EXPECT(GIP_STATUS_ARGUMENT, gip_render(decoder, NULL, NULL, 0, sizeof samples));
    CHECK(!gip_decoder_skipped(NULL, 0) && !gip_decoder_skipped(decoder, 0));
    gip_decoder_free(decoder);
    EXPECT(GIP_STATUS_SIGNATURE, gip_decoder_open("GIF89a..", 8, NULL, &decoder));
    CHECK(!decoder && strstr(gip_last_error(), "not a .gip file"));
    EXPECT(GIP_STATUS_UNEXPECTED_END, gip_decoder_open(NULL, 0, NULL, &decoder));
    EXPECT(GIP_STATUS_ARGUMENT, gip_prefix(file, size, 1 << 20, NULL));
    EXPECT(GIP_STATUS_ARGUMENT, gip_prefix(file, size, 1, &buffer));
    EXPECT(GIP_STATUS_NEED_MORE, gip_prefix(file, 12, 1 << 20, &buffer));
    EXPECT(GIP_STATUS_SIGNATURE, gip_prefix("GIF89a..", 8, 1 << 20, &buffer));
    CHECK(!buffer.data && buffer.size == 0);
    gip_buffer_free(NULL);
    gip_buffer_free(&buffer);
    gip_decoder_free(NULL);
    gip_decoder_free(fed);

    OK(gip_decoder_open(file, size, NULL, &decoder));
    OK(gip_output_size(decoder, NULL, &output));
    CHECK(output.size <= sizeof samples / 4);
    EXPECT(GIP_STATUS_ARGUMENT, gip_render(decoder, NULL, samples, 0, output.size - 1));
    EXPECT(GIP_STATUS_ARGUMENT,
           gip_render(decoder, NULL, samples, output.row_size - 1, sizeof samples));
    EXPECT(GIP_STATUS_ARGUMENT, gip_render(decoder, NULL, samples, (size_t)-1, sizeof samples));
    view.samples = GIP_SAMPLES_F32;
    EXPECT(GIP_STATUS_ARGUMENT,
           gip_render(decoder, &view, (char *)samples + 1, 0, sizeof samples - 1));
    EXPECT(GIP_STATUS_ARGUMENT,
           gip_render(decoder, &view, samples, output.row_size * 4 + 1, sizeof samples));
    /* Each field in turn. */
#define REFUSED(field, value)                                                              \
    do {                                                                                   \
        view = gip_view_default();                                                         \
        view.field = value;                                                                \
        EXPECT(GIP_STATUS_ARGUMENT, gip_render(decoder, &view, samples, 0, sizeof samples)); \
        EXPECT(GIP_STATUS_ARGUMENT, gip_output_size(decoder, &view, &output));             \
    } while (0)
    REFUSED(struct_size, 0);
    REFUSED(struct_size, sizeof view - 8);
    REFUSED(struct_size, (size_t)-1);
    REFUSED(width, 5);
    REFUSED(height, 5);
    REFUSED(width, 1u << 24);
    REFUSED(region_x, 1);
    REFUSED(region_width, 1);
    REFUSED(region_height, 0xFFFFFFFFu);
    REFUSED(color, 5);
    REFUSED(samples, 5);
    REFUSED(flags, 2);
    REFUSED(threads, 1025);

    /* Structures of a later version, whose new fields are not used, and used. */
    memset(&later, 0, sizeof later);
    later.view = gip_view_default();
    later.view.struct_size = sizeof later;
    OK(gip_output_size(decoder, &later.view, &output));
    later.added = 1;
    EXPECT(GIP_STATUS_ARGUMENT, gip_output_size(decoder, &later.view, &output));
    CHECK(strstr(gip_last_error(), "gip_view"));
    limits.struct_size = 0;
    EXPECT(GIP_STATUS_ARGUMENT, gip_decoder_new(&limits, &fed));
    info.struct_size = 1;
    EXPECT(GIP_STATUS_ARGUMENT, gip_decoder_info(decoder, &info));
    gip_decoder_free(decoder);
    free(file);
}

static void prefixes(void)
{
    gip_buffer prefix;
    gip_info info = gip_info_default();
    gip_decoder *decoder;
    size_t size;
    uint8_t *file = read_file(folder, "entropy-layers.gip", &size);
    OK(gip_prefix(file, size, size - 1, &prefix));
    CHECK(prefix.size < size && gip_is_gip(prefix.data, prefix.size));
    OK(gip_decoder_open(prefix.data, prefix.size, NULL, &decoder));
    OK(gip_decoder_finish(decoder, 0));
    OK(gip_decoder_info(decoder, &info));
    CHECK(info.is_complete && info.layers >= 1 && info.layers < 4);
    gip_decoder_free(decoder);
    gip_buffer_free(&prefix);
    gip_buffer_free(&prefix);
    CHECK(!prefix.data && prefix.size == 0);
    free(file);
}

int main(int count, char **arguments)
{
    CHECK(count == 2);
    folder = arguments[1];
    CHECK(*gip_last_error() == '\0');
    versions();
    samples("gray8.gip", 1);
    samples("entropy-rgb16.gip", 3);
    samples("gray-alpha8.gip", 2);
    samples("rgba16.gip", 4);
    composed();
    metadata();
    progressive();
    limits();
    refused();
    prefixes();
    puts("interface: passed");
    return 0;
}

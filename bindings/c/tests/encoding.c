/* Encoding: targets, types of samples, metadata, progress, and what is refused. */

#include <math.h>

#include "test.h"

#define WIDTH 48
#define HEIGHT 40

/* A picture of RGB: soft discs over a gradient. */
static void draw(uint8_t *pixels)
{
    int x, y;
    for (y = 0; y < HEIGHT; y++) {
        for (x = 0; x < WIDTH; x++) {
            double near = hypot(x - 15.0, y - 12.0), far = hypot(x - 34.0, y - 27.0);
            uint8_t *pixel = pixels + 3 * (y * WIDTH + x);
            pixel[0] = (uint8_t)(40 + 180 / (1 + exp(near - 9)));
            pixel[1] = (uint8_t)(60 + 2 * y + 80 / (1 + exp(far - 7)));
            pixel[2] = (uint8_t)(200 - 3 * x);
        }
    }
}

static gip_source source_of(const uint8_t *pixels)
{
    gip_source source = gip_source_default();
    source.width = WIDTH;
    source.height = HEIGHT;
    source.color = GIP_COLOR_RGB;
    source.samples = GIP_SAMPLES_U8;
    source.pixels = pixels;
    source.size = 3 * WIDTH * HEIGHT;
    return source;
}

static gip_encode_options fast(uint32_t target, double value)
{
    gip_encode_options options = gip_encode_options_default();
    options.effort = 1;
    options.target = target;
    options.value = value;
    return options;
}

/* PSNR in dB of a file against its source of 8 bits. */
static double psnr_of(gip_buffer file, const uint8_t *pixels)
{
    gip_view view = gip_view_default();
    uint8_t decoded[3 * WIDTH * HEIGHT];
    gip_decoder *decoder;
    double sum = 0;
    size_t i;
    OK(gip_decoder_open(file.data, file.size, NULL, &decoder));
    view.flags = GIP_VIEW_NO_TEXTURE;
    view.samples = GIP_SAMPLES_U8;
    OK(gip_render(decoder, &view, decoded, 0, sizeof decoded));
    gip_decoder_free(decoder);
    for (i = 0; i < sizeof decoded; i++) {
        sum += pow((double)decoded[i] - pixels[i], 2);
    }
    return 10 * log10(255.0 * 255.0 * sizeof decoded / sum);
}

static void targets(const uint8_t *pixels)
{
    gip_source source = source_of(pixels);
    gip_encode_options options;
    gip_report report = gip_report_default();
    gip_buffer file, again;

    options = fast(GIP_TARGET_BYTES, 700);
    OK(gip_encode(&source, &options, &file, &report));
    CHECK(file.size <= 700 && file.size >= 600);
    CHECK(fabs(report.psnr - psnr_of(file, pixels)) < 0.01);
    CHECK(report.struct_size == sizeof report && report.gaussians > 0 && report.iterations > 0);
    CHECK(report.quality > 0 && report.seconds > 0 && report.peak_memory > 0);
    /* The file depends on no threads, and is the same again. */
    options.threads = 2;
    OK(gip_encode(&source, &options, &again, NULL));
    CHECK(again.size == file.size && memcmp(again.data, file.data, file.size) == 0);
    gip_buffer_free(&again);
    gip_buffer_free(&file);

    options = fast(GIP_TARGET_GAUSSIANS, 40);
    options.texture = GIP_TEXTURE_NONE;
    OK(gip_encode(&source, &options, &file, &report));
    CHECK(report.gaussians <= 40 && report.texture_gaussians == 0 && report.texture_size == 0);
    gip_buffer_free(&file);

    options = fast(GIP_TARGET_PSNR, 30);
    options.tune = GIP_TUNE_PSNR;
    OK(gip_encode(&source, &options, &file, &report));
    CHECK(report.psnr >= 29.99 || report.shortfall == GIP_SHORTFALL_PSNR_BELOW);
    gip_buffer_free(&file);

    options = fast(GIP_TARGET_QUALITY, 40);
    OK(gip_encode(&source, &options, &file, &report));
    CHECK(report.quality >= 38 || report.shortfall == GIP_SHORTFALL_QUALITY_BELOW);
    gip_buffer_free(&file);

    options = fast(GIP_TARGET_BITS_PER_PIXEL, 4);
    options.precision = GIP_PRECISION_F32;
    options.seed = 7;
    OK(gip_encode(&source, &options, &file, &report));
    CHECK(file.size <= WIDTH * HEIGHT * 4 / 8);
    gip_buffer_free(&file);

    /* Out of reach, which is no failure. */
    options = fast(GIP_TARGET_BYTES, 1);
    OK(gip_encode(&source, &options, &file, &report));
    CHECK(report.shortfall == GIP_SHORTFALL_SIZE_ABOVE && report.gaussians == 0);
    gip_buffer_free(&file);
}

/* The same picture with padding, with 16 bits and as floats gives files of the same quality. */
static void samples(const uint8_t *pixels)
{
    gip_encode_options options = fast(GIP_TARGET_BYTES, 700);
    gip_source source = source_of(pixels);
    gip_info info = gip_info_default();
    gip_buffer packed, file;
    gip_decoder *decoder;
    uint8_t padded[HEIGHT][3 * WIDTH + 5];
    uint16_t words[3 * WIDTH * HEIGHT];
    float floats[3 * WIDTH * HEIGHT];
    size_t i;
    OK(gip_encode(&source, &options, &packed, NULL));

    memset(padded, 0xEE, sizeof padded);
    for (i = 0; i < HEIGHT; i++) {
        memcpy(padded[i], pixels + i * 3 * WIDTH, 3 * WIDTH);
    }
    source.pixels = padded;
    source.stride = sizeof padded[0];
    source.size = sizeof padded - 5;
    OK(gip_encode(&source, &options, &file, NULL));
    CHECK(file.size == packed.size && memcmp(file.data, packed.data, file.size) == 0);
    gip_buffer_free(&file);

    for (i = 0; i < 3 * WIDTH * HEIGHT; i++) {
        words[i] = (uint16_t)(pixels[i] * 257);
        floats[i] = (float)pixels[i] / 255;
    }
    source.stride = 0;
    source.samples = GIP_SAMPLES_U16;
    source.pixels = words;
    source.size = sizeof words;
    OK(gip_encode(&source, &options, &file, NULL));
    CHECK(fabs(psnr_of(file, pixels) - psnr_of(packed, pixels)) < 1);
    OK(gip_decoder_open(file.data, file.size, NULL, &decoder));
    OK(gip_decoder_info(decoder, &info));
    CHECK(info.depth == 16 && info.width == WIDTH && info.height == HEIGHT);
    gip_decoder_free(decoder);
    gip_buffer_free(&packed);

    source.samples = GIP_SAMPLES_F32;
    source.pixels = floats;
    source.size = sizeof floats;
    OK(gip_encode(&source, &options, &packed, NULL));
    CHECK(file.size == packed.size && memcmp(file.data, packed.data, file.size) == 0);
    gip_buffer_free(&file);
    gip_buffer_free(&packed);
    floats[17] = (float)NAN;
    EXPECT(GIP_STATUS_ARGUMENT, gip_encode(&source, &options, &file, NULL));
}

static void metadata(const uint8_t *pixels)
{
    static const uint8_t exif[] = "Exif\0\0MM\0*\0\0\0\b\0\1\1\x12\0\3\0\0\0\1\0\6\0\0\0\0\0";
    static const gip_text texts[] = {{"Title", "A \xC3\xA9t\xC3\xA9"}, {"Comment", "at home"}};
    gip_encode_options options = fast(GIP_TARGET_GAUSSIANS, 10);
    gip_source source = source_of(pixels);
    gip_metadata given = gip_metadata_default(), found = gip_metadata_default();
    gip_report report = gip_report_default();
    gip_info info = gip_info_default();
    gip_buffer file, again;
    gip_decoder *decoder;

    given.exif.data = exif;
    given.exif.size = sizeof exif;
    given.icc.data = (const uint8_t *)"not a profile";
    given.icc.size = 13;
    given.xmp.data = (const uint8_t *)"<x:xmpmeta/>";
    given.xmp.size = 12;
    given.texts = texts;
    given.text_count = 2;
    given.present = GIP_METADATA_CICP | GIP_METADATA_CONTENT_LIGHT;
    given.cicp.primaries = 12;
    given.cicp.transfer = 13;
    given.content_light.max_content = 2000000;
    source.metadata = &given;
    OK(gip_encode(&source, &options, &file, &report));
    CHECK(report.metadata_losses == 0);
    OK(gip_decoder_open(file.data, file.size, NULL, &decoder));
    OK(gip_decoder_metadata(decoder, &found));
    CHECK(found.exif.size == sizeof exif - 6 && memcmp(found.exif.data, exif + 6, found.exif.size) == 0);
    CHECK(found.icc.size == 13 && found.xmp.size == 12 && found.text_count == 2);
    CHECK(strcmp(found.texts[0].text, texts[0].text) == 0);
    CHECK(strcmp(found.texts[1].keyword, "Comment") == 0);
    CHECK(found.present == given.present && found.cicp.primaries == 12);
    CHECK(found.content_light.max_content == 2000000);
    OK(gip_decoder_info(decoder, &info));
    CHECK(info.orientation == 6);

    /* What a decoder tells can be given to the encoder as it is. */
    source.metadata = &found;
    OK(gip_encode(&source, &options, &again, NULL));
    CHECK(file.size == again.size && memcmp(file.data, again.data, file.size) == 0);
    gip_buffer_free(&again);
    gip_decoder_free(decoder);
    gip_buffer_free(&file);

    source.metadata = &given;
    options.metadata_policy = GIP_METADATA_POLICY_SAFE;
    OK(gip_encode(&source, &options, &file, &report));
    OK(gip_decoder_open(file.data, file.size, NULL, &decoder));
    OK(gip_decoder_metadata(decoder, &found));
    CHECK(found.text_count == 1 && strcmp(found.texts[0].keyword, "Title") == 0);
    gip_decoder_free(decoder);
    gip_buffer_free(&file);
    options.metadata_policy = GIP_METADATA_POLICY_NONE;
    given.present = 0;
    OK(gip_encode(&source, &options, &file, &report));
    CHECK(report.metadata_losses == (GIP_LOSS_COLOR_PROFILE | GIP_LOSS_ORIENTATION));
    gip_buffer_free(&file);
    options.metadata_policy = GIP_METADATA_POLICY_ALL;

    given.present = 8;
    EXPECT(GIP_STATUS_ARGUMENT, gip_encode(&source, &options, &file, NULL));
    given.present = 0;
    given.exif.size = 5;
    EXPECT(GIP_STATUS_ARGUMENT, gip_encode(&source, &options, &file, NULL));
    given.exif.data = NULL;
    EXPECT(GIP_STATUS_ARGUMENT, gip_encode(&source, &options, &file, NULL));
    given.exif.size = 0;
    given.texts = NULL;
    EXPECT(GIP_STATUS_ARGUMENT, gip_encode(&source, &options, &file, NULL));
}

/* What a callback has seen. */
struct seen {
    unsigned calls, most;
    double fraction;
};

static int on_progress(const gip_progress *progress, void *user)
{
    struct seen *seen = (struct seen *)user;
    CHECK(progress->struct_size == sizeof *progress);
    CHECK(progress->fraction >= seen->fraction && progress->fraction <= 1);
    CHECK(progress->iteration <= progress->iterations);
    seen->fraction = progress->fraction;
    seen->calls++;
    return seen->calls >= seen->most;
}

static void progress(const uint8_t *pixels)
{
    gip_encode_options options = fast(GIP_TARGET_GAUSSIANS, 60);
    gip_source source = source_of(pixels);
    struct seen seen = {0, 1u << 30, 0};
    gip_buffer file, again;
    OK(gip_encode(&source, &options, &file, NULL));
    options.progress = on_progress;
    options.user = &seen;
    OK(gip_encode(&source, &options, &again, NULL));
    /* Reports that come while this thread waits to run are told as one: how many is up to the scheduler. */
    CHECK(seen.calls > 0 && again.size == file.size);
    CHECK(memcmp(again.data, file.data, file.size) == 0);
    gip_buffer_free(&again);
    seen.calls = 0;
    seen.most = 1;
    seen.fraction = 0;
    options.threads = 2;
    EXPECT(GIP_STATUS_CANCELLED, gip_encode(&source, &options, &again, NULL));
    CHECK(seen.calls == 1 && !again.data && again.size == 0);
    gip_buffer_free(&file);
}

static void refused(const uint8_t *pixels)
{
    gip_encode_options options = fast(GIP_TARGET_AUTO, 0);
    gip_limits limits = gip_limits_default();
    gip_report report = gip_report_default();
    gip_source source = source_of(pixels);
    gip_buffer file;
    EXPECT(GIP_STATUS_ARGUMENT, gip_encode(NULL, &options, &file, NULL));
    EXPECT(GIP_STATUS_ARGUMENT, gip_encode(&source, &options, NULL, NULL));
    report.struct_size = 0;
    EXPECT(GIP_STATUS_ARGUMENT, gip_encode(&source, &options, &file, &report));
    limits.max_width = WIDTH - 1;
    options.limits = &limits;
    EXPECT(GIP_STATUS_LIMIT, gip_encode(&source, &options, &file, NULL));
    CHECK(!file.data);
#define REFUSED(object, field, value)                                                      \
    do {                                                                                   \
        options = fast(GIP_TARGET_AUTO, 0);                                                \
        source = source_of(pixels);                                                        \
        object.field = value;                                                              \
        EXPECT(GIP_STATUS_ARGUMENT, gip_encode(&source, &options, &file, NULL));           \
    } while (0)
    REFUSED(source, struct_size, 0);
    REFUSED(source, width, 0);
    REFUSED(source, height, 0);
    REFUSED(source, width, WIDTH + 1);
    REFUSED(source, height, 0xFFFFFFFFu);
    REFUSED(source, width, 0xFFFFFFFFu);
    REFUSED(source, color, GIP_COLOR_FILE);
    REFUSED(source, color, 5);
    REFUSED(source, samples, GIP_SAMPLES_FILE);
    REFUSED(source, samples, GIP_SAMPLES_F32_PLANES);
    REFUSED(source, samples, GIP_SAMPLES_U16);
    REFUSED(source, pixels, NULL);
    REFUSED(source, stride, 3 * WIDTH - 1);
    REFUSED(source, stride, (size_t)-1);
    REFUSED(source, size, 3 * WIDTH * HEIGHT - 1);
    REFUSED(options, struct_size, 8);
    REFUSED(options, target, 7);
    REFUSED(options, target, GIP_TARGET_BYTES);
    REFUSED(options, tune, 2);
    REFUSED(options, effort, 8);
    REFUSED(options, effort, 1000);
    REFUSED(options, precision, 3);
    REFUSED(options, texture, 101);
    REFUSED(options, texture, -2);
    REFUSED(options, first_layer, 79);
    REFUSED(options, threads, 1025);
    REFUSED(options, flags, 2);
    REFUSED(options, metadata_policy, 3);
    options = fast(GIP_TARGET_BYTES, 700.5);
    EXPECT(GIP_STATUS_ARGUMENT, gip_encode(&source, &options, &file, NULL));
    options = fast(GIP_TARGET_QUALITY, NAN);
    EXPECT(GIP_STATUS_ARGUMENT, gip_encode(&source, &options, &file, NULL));
    options = fast(GIP_TARGET_GAUSSIANS, -1);
    EXPECT(GIP_STATUS_ARGUMENT, gip_encode(&source, &options, &file, NULL));
    CHECK(strstr(gip_last_error(), "value -1;"));
    options = fast(GIP_TARGET_BYTES, 1e12);
    EXPECT(GIP_STATUS_ARGUMENT, gip_encode(&source, &options, &file, NULL));
    CHECK(strstr(gip_last_error(), "value 1000000000000;"));
}

int main(void)
{
    static uint8_t pixels[3 * WIDTH * HEIGHT];
    draw(pixels);
    refused(pixels);
    targets(pixels);
    samples(pixels);
    metadata(pixels);
    progress(pixels);
    puts("encoding: passed");
    return 0;
}

/*
 * Two threads at a time: with decoders of their own, with one that they share, and encoding.
 *
 *     threads spec/vectors
 */

#include <pthread.h>
#include <sys/wait.h>
#include <unistd.h>

#include "test.h"

#define ROUNDS 20

static uint8_t *file;
static size_t size;
/* What all renderings have to be. */
static uint32_t whole;

static uint32_t render(gip_decoder *decoder, uint32_t threads)
{
    gip_view view = gip_view_default();
    gip_output output = gip_output_default();
    uint8_t *samples;
    uint32_t crc;
    view.threads = threads;
    OK(gip_output_size(decoder, &view, &output));
    samples = (uint8_t *)allocate(output.size);
    OK(gip_render(decoder, &view, samples, 0, output.size));
    crc = crc32_of(0, samples, output.size);
    free(samples);
    return crc;
}

static void *decode_own(void *failing)
{
    gip_decoder *decoder;
    int round;
    for (round = 0; round < ROUNDS; round++) {
        OK(gip_decoder_open(file, size, NULL, &decoder));
        CHECK(render(decoder, 1 + round % 2) == whole);
        gip_decoder_free(decoder);
        if (failing) {
            EXPECT(GIP_STATUS_SIGNATURE, gip_decoder_open("GIF89a..", 8, NULL, &decoder));
            CHECK(strstr(gip_last_error(), "not a .gip file"));
        } else {
            /* The failures are the other thread's. */
            CHECK(*gip_last_error() == '\0');
        }
    }
    return NULL;
}

static void *render_shared(void *decoder)
{
    gip_info info = gip_info_default();
    int round;
    for (round = 0; round < ROUNDS; round++) {
        CHECK(render((gip_decoder *)decoder, round % 3) == whole);
        OK(gip_decoder_info((gip_decoder *)decoder, &info));
        CHECK(info.is_complete);
    }
    return NULL;
}

static void *encode(void *threads)
{
    static const uint8_t pixels[] = {0, 50, 100, 150, 200, 250, 0, 50, 100, 150, 200, 250};
    gip_source source = gip_source_default();
    gip_encode_options options = gip_encode_options_default();
    gip_buffer encoded;
    gip_decoder *decoder;
    source.width = 4;
    source.height = 3;
    source.color = GIP_COLOR_GRAY;
    source.samples = GIP_SAMPLES_U8;
    source.pixels = pixels;
    source.size = sizeof pixels;
    options.effort = 1;
    options.target = GIP_TARGET_GAUSSIANS;
    options.value = 4;
    options.threads = *(const uint32_t *)threads;
    OK(gip_encode(&source, &options, &encoded, NULL));
    OK(gip_decoder_open(encoded.data, encoded.size, NULL, &decoder));
    OK(gip_decoder_finish(decoder, 0));
    gip_decoder_free(decoder);
    gip_buffer_free(&encoded);
    return NULL;
}

static void together(void *(*work)(void *), void *first, void *second)
{
    pthread_t threads[2];
    CHECK(pthread_create(&threads[0], NULL, work, first) == 0);
    CHECK(pthread_create(&threads[1], NULL, work, second) == 0);
    CHECK(pthread_join(threads[0], NULL) == 0 && pthread_join(threads[1], NULL) == 0);
}

int main(int count, char **arguments)
{
    uint32_t threads[] = {1, 2};
    gip_decoder *decoder;
    pid_t child;
    int status;
    CHECK(count == 2);
    file = read_file(arguments[1], "entropy-bounds.gip", &size);
    OK(gip_decoder_open(file, size, NULL, &decoder));
    whole = render(decoder, 1);
    together(render_shared, decoder, decoder);
    gip_decoder_free(decoder);
    OK(gip_decoder_new(NULL, &decoder));
    OK(gip_decoder_feed(decoder, file, size, NULL));
    together(render_shared, decoder, decoder);
    together(decode_own, NULL, file);
    together(encode, &threads[0], &threads[1]);

    /* No thread of the library is left, so the child of a fork can go on. */
    child = fork();
    CHECK(child >= 0);
    if (child == 0) {
        int wrong = render(decoder, 2) != whole;
        encode(&threads[1]);
        gip_decoder_free(decoder);
        free(file);
        exit(wrong);
    }
    CHECK(waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0);
    gip_decoder_free(decoder);
    free(file);
    puts("threads: passed");
    return 0;
}

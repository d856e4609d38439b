/* SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * What the program vips does not do: buffers, random access from many threads, and an encoding that is given up.
 * test PICTURE.gip, of three bands and 8 bits */
#include <stdlib.h>
#include <string.h>
#include <vips/vips.h>

#define CHECK(condition) \
    do { \
        if (!(condition)) \
            vips_error_exit("test.c, line %d: %s", __LINE__, #condition); \
    } while (0)

/* Gives up an encoding that takes seconds while it runs. */
static gpointer give_up(gpointer image)
{
    g_usleep(20000);
    vips_image_set_kill(image, TRUE);
    return NULL;
}

int main(int argc, char **argv)
{
    VipsImage *picture, *again, *whole, *part, *same;
    void *bytes, *file, *pixels;
    size_t size, file_size, pixels_size;
    GThread *thread;
    double least;
    int i;

    if (VIPS_INIT(argv[0]) || argc != 2)
        vips_error_exit("usage: test PICTURE.gip");
    CHECK(g_file_get_contents(argv[1], (char **)&bytes, &size, NULL));
    CHECK((picture = vips_image_new_from_buffer(bytes, size, "", NULL)));
    CHECK((whole = vips_image_copy_memory(picture)));

    /* Parts have the samples of the whole. */
    srand(1);
    for (i = 0; i < 50; i++) {
        int width = 1 + rand() % whole->Xsize;
        int height = 1 + rand() % whole->Ysize;
        int left = rand() % (whole->Xsize - width + 1);
        int top = rand() % (whole->Ysize - height + 1);
        VipsImage *expected;

        CHECK(!vips_crop(picture, &part, left, top, width, height, NULL));
        CHECK(!vips_crop(whole, &expected, left, top, width, height, NULL));
        CHECK(!vips_equal(part, expected, &same, NULL));
        CHECK(!vips_min(same, &least, NULL) && least == 255.0);
        g_object_unref(same);
        g_object_unref(part);
        g_object_unref(expected);
    }

    /* The file in memory is that of the default options, and its pixels are near the source. */
    CHECK(!vips_image_write_to_buffer(whole, ".gip", &file, &file_size, "Q", 90, "effort", 1, NULL));
    CHECK((again = vips_image_new_from_buffer(file, file_size, "", NULL)));
    CHECK(again->Xsize == whole->Xsize && again->Bands == 3 && again->BandFmt == VIPS_FORMAT_UCHAR);
    CHECK((pixels = vips_image_write_to_memory(again, &pixels_size)));
    CHECK(pixels_size == (size_t)whole->Xsize * (size_t)whole->Ysize * 3);
    g_object_unref(again);
    g_free(file);
    g_free(pixels);

    vips_image_set_progress(whole, TRUE);
    thread = g_thread_new("give up", give_up, whole);
    CHECK(vips_image_write_to_buffer(whole, ".gip", &file, &file_size, "effort", 7, NULL));
    CHECK(strstr(vips_error_buffer(), "kill"));
    g_thread_join(thread);

    g_object_unref(whole);
    g_object_unref(picture);
    g_free(bytes);
    vips_shutdown();
    return 0;
}

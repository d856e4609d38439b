/* SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * Loads pictures as programs do: at once, byte by byte, scaled, cut off; and saves them. test VECTORS */
#include <gdk-pixbuf/gdk-pixbuf.h>
#include <string.h>

static char *bytes_of(const char *folder, const char *name, gsize *size)
{
    char *path = g_build_filename(folder, name, NULL);
    char *bytes;

    g_assert_true(g_file_get_contents(path, &bytes, size, NULL));
    g_free(path);
    return bytes;
}

static void resize(GdkPixbufLoader *loader, int width, int height, gpointer divisor)
{
    gdk_pixbuf_loader_set_size(loader, width / GPOINTER_TO_INT(divisor), height / GPOINTER_TO_INT(divisor));
}

static void count(GdkPixbufLoader *loader, int x, int y, int width, int height, gpointer updates)
{
    GdkPixbuf *pixbuf = gdk_pixbuf_loader_get_pixbuf(loader);

    g_assert_true(x == 0 && y == 0);
    g_assert_cmpint(width, ==, gdk_pixbuf_get_width(pixbuf));
    g_assert_cmpint(height, ==, gdk_pixbuf_get_height(pixbuf));
    ++*(int *)updates;
}

/* What arrives in pieces, or null. */
static GdkPixbuf *loaded(const char *bytes, gsize size, gsize piece, int divisor, int *updates)
{
    GdkPixbufLoader *loader = gdk_pixbuf_loader_new_with_type("gip", NULL);
    GdkPixbuf *pixbuf;
    gboolean is_well = TRUE;
    gsize at;

    g_assert_nonnull(loader);
    *updates = 0;
    g_signal_connect(loader, "area-updated", G_CALLBACK(count), updates);
    if (divisor != 1)
        g_signal_connect(loader, "size-prepared", G_CALLBACK(resize), GINT_TO_POINTER(divisor));
    for (at = 0; is_well && at < size; at += piece)
        is_well = gdk_pixbuf_loader_write(loader, (const guchar *)bytes + at, MIN(piece, size - at), NULL);
    is_well = gdk_pixbuf_loader_close(loader, NULL) && is_well;
    pixbuf = is_well ? g_object_ref(gdk_pixbuf_loader_get_pixbuf(loader)) : NULL;
    g_object_unref(loader);
    return pixbuf;
}

/* Why a file of which `size` bytes arrive is refused. */
static void check_refusal(const char *folder, const char *name, gsize size, const char *reason)
{
    GdkPixbufLoader *loader = gdk_pixbuf_loader_new_with_type("gip", NULL);
    GError *error = NULL;
    gsize whole;
    char *bytes = bytes_of(folder, name, &whole);

    if (gdk_pixbuf_loader_write(loader, (const guchar *)bytes, MIN(size, whole), &error))
        g_assert_false(gdk_pixbuf_loader_close(loader, &error));
    else
        gdk_pixbuf_loader_close(loader, NULL);
    g_assert_nonnull(error);
    if (!strstr(error->message, reason))
        g_error("%s, %d bytes: %s", name, (int)size, error->message);
    g_error_free(error);
    g_object_unref(loader);
    g_free(bytes);
}

static void check_same(GdkPixbuf *a, GdkPixbuf *b)
{
    gsize row = (gsize)gdk_pixbuf_get_width(a) * (gsize)gdk_pixbuf_get_n_channels(a);
    int y;

    g_assert_cmpint(gdk_pixbuf_get_width(a), ==, gdk_pixbuf_get_width(b));
    g_assert_cmpint(gdk_pixbuf_get_height(a), ==, gdk_pixbuf_get_height(b));
    g_assert_cmpint(gdk_pixbuf_get_n_channels(a), ==, gdk_pixbuf_get_n_channels(b));
    for (y = 0; y < gdk_pixbuf_get_height(a); y++)
        g_assert_cmpint(memcmp(gdk_pixbuf_read_pixels(a) + y * gdk_pixbuf_get_rowstride(a),
                               gdk_pixbuf_read_pixels(b) + y * gdk_pixbuf_get_rowstride(b), row), ==, 0);
}

int main(int argc, char **argv)
{
    const char *folder = argv[1];
    GdkPixbuf *pixbuf, *again;
    GError *error = NULL;
    GLogLevelFlags fatal;
    GDir *vectors;
    const char *name;
    char *bytes, *path;
    gsize size, part;
    int updates, all_updates, width, height;

    g_assert_cmpint(argc, ==, 2);

    /* At once and byte by byte, which shows more and more of the layers. */
    bytes = bytes_of(folder, "entropy-layers.gip", &size);
    pixbuf = loaded(bytes, size, size, 1, &updates);
    again = loaded(bytes, size, 1, 1, &all_updates);
    g_assert_cmpint(updates, ==, 1);
    g_assert_cmpint(all_updates, >, 2);
    check_same(pixbuf, again);
    g_assert_cmpstr(gdk_pixbuf_get_option(pixbuf, "orientation"), ==, "1");
    g_object_unref(again);
    again = loaded(bytes, size, 7, 2, &updates);
    g_assert_cmpint(gdk_pixbuf_get_width(again), ==, gdk_pixbuf_get_width(pixbuf) / 2);
    g_object_unref(again);

    /* A program that wants no pixels. */
    g_assert_null(loaded(bytes, size, size, 1 << 20, &updates));

    /* Files that are cut off: from the first layer on there is a picture, with a warning. */
    fatal = g_log_set_always_fatal(G_LOG_LEVEL_CRITICAL);
    for (part = 1, updates = 0; part < size; part++) {
        again = loaded(bytes, part, 64, 1, &all_updates);
        if (again)
            updates++;
        g_clear_object(&again);
    }
    g_assert_cmpint(updates, >, 20);
    g_assert_cmpint(updates, <, (int)size - 50);
    g_free(bytes);
    g_object_unref(pixbuf);

    /* All vectors, those that are to be refused too. */
    g_assert_nonnull((vectors = g_dir_open(folder, 0, NULL)));
    while ((name = g_dir_read_name(vectors))) {
        if (!g_str_has_suffix(name, ".gip"))
            continue;
        bytes = bytes_of(folder, name, &size);
        pixbuf = loaded(bytes, size, 16, 1, &updates);
        if (name[0] != 'x')
            g_assert_nonnull(pixbuf);
        g_clear_object(&pixbuf);
        g_free(bytes);
    }
    g_dir_close(vectors);
    check_refusal(folder, "xversion.gip", G_MAXSIZE, "version 2");
    check_refusal(folder, "xcrc-header.gip", G_MAXSIZE, "CRC");
    check_refusal(folder, "xwidth-zero.gip", G_MAXSIZE, "width");
    check_refusal(folder, "rgb8.gip", 12, "unexpected end");
    check_refusal(folder, "rgb8.gip", 60, "unexpected end");
    g_log_set_always_fatal(fatal);

    /* Metadata, and the size without a picture. */
    path = g_build_filename(folder, "metadata.gip", NULL);
    pixbuf = gdk_pixbuf_new_from_file(path, &error);
    g_assert_no_error(error);
    g_assert_cmpstr(gdk_pixbuf_get_option(pixbuf, "orientation"), ==, "6");
    g_assert_cmpstr(gdk_pixbuf_get_option(pixbuf, "tEXt::Title"), ==, "Dämmerung über dem Meer");
    g_assert_true(g_str_has_prefix(gdk_pixbuf_get_option(pixbuf, "icc-profile"), "bm90IGEg"));
    g_assert_nonnull(gdk_pixbuf_get_file_info(path, &width, &height));
    g_assert_cmpint(width, ==, gdk_pixbuf_get_width(pixbuf));
    g_assert_cmpint(height, ==, gdk_pixbuf_get_height(pixbuf));
    g_free(path);

    /* Saved, and loaded again. */
    g_assert_false(gdk_pixbuf_save_to_buffer(pixbuf, &bytes, &size, "gip", &error, "quality", "much", NULL));
    g_assert_error(error, GDK_PIXBUF_ERROR, GDK_PIXBUF_ERROR_BAD_OPTION);
    g_clear_error(&error);
    g_assert_true(gdk_pixbuf_save_to_buffer(pixbuf, &bytes, &size, "gip", &error, "quality", "90", NULL));
    g_assert_no_error(error);
    again = loaded(bytes, size, size, 1, &updates);
    g_assert_cmpint(gdk_pixbuf_get_width(again), ==, gdk_pixbuf_get_width(pixbuf));
    g_object_unref(again);
    g_object_unref(pixbuf);
    g_free(bytes);
    pixbuf = gdk_pixbuf_new(GDK_COLORSPACE_RGB, TRUE, 8, 33, 20);
    gdk_pixbuf_fill(pixbuf, 0x4080c080);
    g_assert_true(gdk_pixbuf_save_to_buffer(pixbuf, &bytes, &size, "gip", NULL, NULL));
    again = loaded(bytes, size, size, 1, &updates);
    check_same(pixbuf, again);
    g_object_unref(again);
    g_object_unref(pixbuf);
    g_free(bytes);
    return 0;
}

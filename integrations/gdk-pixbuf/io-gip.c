/* SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * A loader module for gdk-pixbuf: pictures are shown as they arrive, at the size that is asked for. */
#define GDK_PIXBUF_ENABLE_BACKEND
#include <gdk-pixbuf/gdk-pixbuf.h>
#include <gip.h>

typedef struct {
    gip_decoder *decoder;
    GdkPixbufModuleSizeFunc size_func;
    GdkPixbufModulePreparedFunc prepared_func;
    GdkPixbufModuleUpdatedFunc updated_func;
    gpointer user_data;
    /* Set when the header has arrived. */
    GdkPixbuf *pixbuf;
    gip_view view;
    /* Of which there is a rendering. */
    guint32 layers;
    /* No more of the file is wanted: it is all there, or suffices, or cannot be shown further. */
    gboolean is_done;
} GipContext;

static gboolean failed(GError **error, gip_status status)
{
    int code = status == GIP_STATUS_LIMIT || status == GIP_STATUS_MEMORY ? GDK_PIXBUF_ERROR_INSUFFICIENT_MEMORY
        : status == GIP_STATUS_UNSUPPORTED                               ? GDK_PIXBUF_ERROR_UNKNOWN_TYPE
                                                                         : GDK_PIXBUF_ERROR_CORRUPT_IMAGE;

    g_set_error_literal(error, GDK_PIXBUF_ERROR, code, gip_last_error());
    return FALSE;
}

static void context_free(GipContext *context)
{
    gip_decoder_free(context->decoder);
    g_clear_object(&context->pixbuf);
    g_free(context);
}

static gpointer begin_load(GdkPixbufModuleSizeFunc size_func, GdkPixbufModulePreparedFunc prepared_func,
                           GdkPixbufModuleUpdatedFunc updated_func, gpointer user_data, GError **error)
{
    GipContext *context = g_new0(GipContext, 1);
    gip_status status = gip_decoder_new(NULL, &context->decoder);

    context->size_func = size_func;
    context->prepared_func = prepared_func;
    context->updated_func = updated_func;
    context->user_data = user_data;
    if (status) {
        failed(error, status);
        g_clear_pointer(&context, context_free);
    }
    return context;
}

/* Makes the pixbuf, at the size that the program wants. */
static gboolean prepare(GipContext *context, const gip_info *info, GError **error)
{
    int width = (int)info->width;
    int height = (int)info->height;
    gboolean has_alpha = info->color == GIP_COLOR_GRAY_ALPHA || info->color == GIP_COLOR_RGBA;
    gip_output output = gip_output_default();
    gip_status status;

    if (context->size_func)
        context->size_func(&width, &height, context->user_data);
    /* So a program says that it has learned enough. */
    if (width <= 0 || height <= 0) {
        g_set_error_literal(error, GDK_PIXBUF_ERROR, GDK_PIXBUF_ERROR_FAILED, "A picture without pixels is wanted");
        return FALSE;
    }
    context->view = gip_view_default();
    context->view.width = (guint32)width;
    context->view.height = (guint32)height;
    context->view.color = has_alpha ? GIP_COLOR_RGBA : GIP_COLOR_RGB;
    context->view.samples = GIP_SAMPLES_U8;
    if (context->view.width < info->width && context->view.height < info->height)
        gip_decoder_gaussians_for(context->decoder, context->view.width, context->view.height,
                                  &context->view.gaussians);
    status = gip_output_size(context->decoder, &context->view, &output);
    if (status)
        return failed(error, status);
    context->pixbuf = gdk_pixbuf_new(GDK_COLORSPACE_RGB, has_alpha, 8, width, height);
    if (!context->pixbuf) {
        g_set_error_literal(error, GDK_PIXBUF_ERROR, GDK_PIXBUF_ERROR_INSUFFICIENT_MEMORY,
                            "There is no memory for the picture");
        return FALSE;
    }
    return TRUE;
}

/* Shows what has arrived. */
static gboolean render(GipContext *context, GError **error)
{
    GdkPixbuf *pixbuf = context->pixbuf;
    gip_status status = gip_render(context->decoder, &context->view, gdk_pixbuf_get_pixels(pixbuf),
                                   (size_t)gdk_pixbuf_get_rowstride(pixbuf), gdk_pixbuf_get_byte_length(pixbuf));

    return status ? failed(error, status) : TRUE;
}

static void tell_update(GipContext *context)
{
    context->updated_func(context->pixbuf, 0, 0, gdk_pixbuf_get_width(context->pixbuf),
                          gdk_pixbuf_get_height(context->pixbuf), context->user_data);
}

/* Sets what programs ask a pixbuf for. Options that are there remain as they are. */
static void set_options(GipContext *context, const gip_info *info)
{
    gip_metadata metadata = gip_metadata_default();
    size_t i;

    if (info->orientation > 0) {
        char orientation[] = {(char)('0' + info->orientation), 0};

        gdk_pixbuf_set_option(context->pixbuf, "orientation", orientation);
    }
    gip_decoder_metadata(context->decoder, &metadata);
    if (metadata.icc.size > 0 && !(metadata.present & GIP_METADATA_CICP)) {
        char *profile = g_base64_encode(metadata.icc.data, metadata.icc.size);

        gdk_pixbuf_set_option(context->pixbuf, "icc-profile", profile);
        g_free(profile);
    }
    for (i = 0; i < metadata.text_count; i++) {
        char *key = g_strconcat("tEXt::", metadata.texts[i].keyword, NULL);

        gdk_pixbuf_set_option(context->pixbuf, key, metadata.texts[i].text);
        g_free(key);
    }
}

/* Whether there is something to show before `status`, which the library has just found: a warning says why no more,
 * or else the error why nothing. */
static gboolean is_shown_until(GipContext *context, gip_status status, GError **error)
{
    gip_info info = gip_info_default();
    GError *found = NULL;

    /* Before what follows fails for a reason of its own. */
    failed(&found, status);
    if (gip_decoder_info(context->decoder, &info) || info.decoded_gaussians == 0) {
        g_propagate_error(error, found);
        return FALSE;
    }
    g_warning("%s", found->message);
    g_error_free(found);
    return TRUE;
}

static gboolean take(GipContext *context, const guchar *bytes, guint size, GError **error)
{
    gip_info info = gip_info_default();
    gip_status status = gip_decoder_feed(context->decoder, bytes, size, NULL);
    gboolean is_first = !context->pixbuf;

    /* What precedes damage can be shown, if there is something. */
    if (status && !is_shown_until(context, status, error))
        return FALSE;
    if (gip_decoder_info(context->decoder, &info))
        return TRUE;
    if (is_first && !prepare(context, &info, error))
        return FALSE;
    context->is_done = status || info.is_complete
        || (context->view.gaussians && context->view.gaussians < info.gaussians
            && info.decoded_gaussians >= context->view.gaussians);
    if (is_first || info.decoded_layers != context->layers || context->is_done) {
        context->layers = info.decoded_layers;
        set_options(context, &info);
        if (!render(context, error))
            return FALSE;
        if (is_first)
            context->prepared_func(context->pixbuf, NULL, context->user_data);
        tell_update(context);
    }
    return TRUE;
}

static gboolean load_increment(gpointer data, const guchar *bytes, guint size, GError **error)
{
    GipContext *context = data;

    if (context->is_done || take(context, bytes, size, error))
        return TRUE;
    context->is_done = TRUE;
    return FALSE;
}

static gboolean stop_load(gpointer data, GError **error)
{
    GipContext *context = data;
    gboolean result = TRUE;

    if (!context->is_done) {
        gip_status status = gip_decoder_finish(context->decoder, 0);

        if (status && !is_shown_until(context, status, error)) {
            result = FALSE;
        } else if (status) {
            /* A part of a layer may have arrived. */
            result = render(context, error);
            tell_update(context);
        }
    }
    context_free(context);
    return result;
}

static gboolean save_to_callback(GdkPixbufSaveFunc save, gpointer user_data, GdkPixbuf *pixbuf, gchar **keys,
                                 gchar **values, GError **error)
{
    gip_source source = gip_source_default();
    gip_encode_options options = gip_encode_options_default();
    gip_buffer file;
    gip_status status;
    gboolean saved;
    guint i;

    for (i = 0; keys && keys[i]; i++) {
        char *end;

        if (g_strcmp0(keys[i], "quality") != 0)
            continue;
        options.target = GIP_TARGET_QUALITY;
        options.value = g_ascii_strtod(values[i], &end);
        if (end == values[i] || *end || options.value < 0 || options.value > 100) {
            g_set_error(error, GDK_PIXBUF_ERROR, GDK_PIXBUF_ERROR_BAD_OPTION, "A quality is 0 to 100, not “%s”",
                        values[i]);
            return FALSE;
        }
    }
    source.width = (guint32)gdk_pixbuf_get_width(pixbuf);
    source.height = (guint32)gdk_pixbuf_get_height(pixbuf);
    source.color = gdk_pixbuf_get_has_alpha(pixbuf) ? GIP_COLOR_RGBA : GIP_COLOR_RGB;
    source.samples = GIP_SAMPLES_U8;
    source.pixels = gdk_pixbuf_read_pixels(pixbuf);
    source.stride = (size_t)gdk_pixbuf_get_rowstride(pixbuf);
    source.size = gdk_pixbuf_get_byte_length(pixbuf);
    options.threads = g_get_num_processors();
    status = gip_encode(&source, &options, &file, NULL);
    if (status)
        return failed(error, status);
    saved = save((const gchar *)file.data, file.size, error, user_data);
    gip_buffer_free(&file);
    return saved;
}

static gboolean is_save_option_supported(const gchar *key)
{
    return g_strcmp0(key, "quality") == 0;
}

G_MODULE_EXPORT void fill_vtable(GdkPixbufModule *module)
{
    module->begin_load = begin_load;
    module->load_increment = load_increment;
    module->stop_load = stop_load;
    module->save_to_callback = save_to_callback;
    module->is_save_option_supported = is_save_option_supported;
}

G_MODULE_EXPORT void fill_info(GdkPixbufFormat *info)
{
    static GdkPixbufModulePattern signature[] = {{"\xc7GIP\r\n", "      ", 100}, {NULL, NULL, 0}};
    static gchar *types[] = {"image/vnd.gip", NULL};
    static gchar *extensions[] = {"gip", NULL};

    info->name = "gip";
    info->signature = signature;
    info->description = "GIP";
    info->mime_types = types;
    info->extensions = extensions;
    info->flags = GDK_PIXBUF_FORMAT_WRITABLE | GDK_PIXBUF_FORMAT_THREADSAFE;
    info->license = "MIT OR Apache-2.0";
}

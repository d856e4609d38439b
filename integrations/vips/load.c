/* SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * gipload, gipload_buffer and gipload_source. */
#include "module.h"

#include <gip.h>
#include <string.h>
#include <vips/vips.h>

typedef struct {
    VipsForeignLoad parent;
    VipsSource *source;
    double scale;
    /* Set by header(). */
    const void *data;
    size_t size;
    gip_info info;
    gip_view view;
    gip_output output;
} GipLoad;

typedef VipsForeignLoadClass GipLoadClass;

G_DEFINE_ABSTRACT_TYPE(GipLoad, gip_load, VIPS_TYPE_FOREIGN_LOAD)

/* What each class needs that has properties of its own. */
static void take_properties(gpointer class)
{
    G_OBJECT_CLASS(class)->set_property = vips_object_set_property;
    G_OBJECT_CLASS(class)->get_property = vips_object_get_property;
}

static int failed(GipLoad *gip)
{
    vips_error(VIPS_OBJECT_GET_CLASS(gip)->nickname, "%s", gip_last_error());
    return -1;
}

static void gip_load_dispose(GObject *object)
{
    VIPS_UNREF(((GipLoad *)object)->source);
    G_OBJECT_CLASS(gip_load_parent_class)->dispose(object);
}

/* Any part can be rendered, at any time. */
static VipsForeignFlags gip_load_get_flags(VipsForeignLoad *load)
{
    return VIPS_FOREIGN_PARTIAL;
}

static int init_image(GipLoad *gip, VipsImage *image)
{
    gboolean wide = gip->output.samples == GIP_SAMPLES_U16;
    gboolean gray = gip->output.color < GIP_COLOR_RGB;
    VipsInterpretation interpretation = gray ? (wide ? VIPS_INTERPRETATION_GREY16 : VIPS_INTERPRETATION_B_W)
                                             : (wide ? VIPS_INTERPRETATION_RGB16 : VIPS_INTERPRETATION_sRGB);

    vips_image_init_fields(image, (int)gip->output.width, (int)gip->output.height, (int)gip->output.color,
                           wide ? VIPS_FORMAT_USHORT : VIPS_FORMAT_UCHAR, VIPS_CODING_NONE, interpretation, 1.0, 1.0);
    /* Each rendering looks at all Gaussians, so parts should not be too small. */
    return vips_image_pipelinev(image, VIPS_DEMAND_STYLE_FATSTRIP, NULL);
}

static void set_blob(VipsImage *image, const char *name, const char *prefix, size_t prefix_size, gip_blob blob)
{
    char *copy;

    if (blob.size == 0)
        return;
    copy = g_malloc(prefix_size + blob.size);
    memcpy(copy, prefix, prefix_size);
    memcpy(copy + prefix_size, blob.data, blob.size);
    vips_image_set_blob(image, name, (VipsCallbackFn)vips_area_free_cb, copy, prefix_size + blob.size);
}

static void set_profile(VipsImage *image, const gip_metadata *metadata)
{
    VipsBlob *profile = NULL;
    gip_blob bytes = metadata->icc;

    /* Codes count before a profile. libvips has the profile of Display P3, and knows no other of their colours. */
    if (metadata->present & GIP_METADATA_CICP) {
        if (metadata->cicp.primaries == 1 && metadata->cicp.transfer == 13)
            return;
        if (metadata->cicp.primaries == 12 && metadata->cicp.transfer == 13 && !vips_profile_load("p3", &profile, NULL))
            bytes.data = vips_blob_get(profile, &bytes.size);
        else if (bytes.size == 0)
            g_warning("colours of primaries %d and transfer function %d are taken for those of sRGB",
                      metadata->cicp.primaries, metadata->cicp.transfer);
    }
    set_blob(image, VIPS_META_ICC_NAME, "", 0, bytes);
    if (profile)
        vips_area_unref(VIPS_AREA(profile));
}

static void set_metadata(GipLoad *gip, VipsImage *image, const gip_metadata *metadata)
{
    size_t i;

    set_profile(image, metadata);
    /* libvips has Exif as it is in JPEG. */
    set_blob(image, VIPS_META_EXIF_NAME, "Exif\0\0", 6, metadata->exif);
    set_blob(image, VIPS_META_XMP_NAME, "", 0, metadata->xmp);
    for (i = 0; i < metadata->text_count; i++) {
        char *name = g_strdup_printf("gip-text-%d-%s", (int)i, metadata->texts[i].keyword);

        vips_image_set_string(image, name, metadata->texts[i].text);
        g_free(name);
    }
    if (gip->info.orientation > 0)
        vips_image_set_int(image, VIPS_META_ORIENTATION, (int)gip->info.orientation);
}

static guint32 scaled(guint32 side, double scale)
{
    return (guint32)VIPS_CLIP(1.0, side * scale + 0.5, (double)UINT32_MAX);
}

static int gip_load_header(VipsForeignLoad *load)
{
    GipLoad *gip = (GipLoad *)load;
    gip_metadata metadata = gip_metadata_default();
    gip_decoder *decoder;
    int result = -1;

    if (!(gip->data = vips_source_map(gip->source, &gip->size)))
        return -1;
    if (gip_decoder_open(gip->data, gip->size, NULL, &decoder))
        return failed(gip);
    gip->info = gip_info_default();
    gip->view = gip_view_default();
    gip->output = gip_output_default();
    if (gip_decoder_info(decoder, &gip->info)) {
        failed(gip);
        goto done;
    }
    if (gip->scale != 1.0) {
        gip->view.width = scaled(gip->info.width, gip->scale);
        gip->view.height = scaled(gip->info.height, gip->scale);
    }
    if (gip->scale < 1.0)
        gip_decoder_gaussians_for(decoder, gip->view.width, gip->view.height, &gip->view.gaussians);
    if (gip_output_size(decoder, &gip->view, &gip->output)) {
        failed(gip);
        goto done;
    }
    /* What precedes damage is there all the same, and load() tells the damage. */
    gip_decoder_metadata(decoder, &metadata);
    set_metadata(gip, load->out, &metadata);
    result = init_image(gip, load->out);
    VIPS_SETSTR(load->out->filename, vips_connection_filename(VIPS_CONNECTION(gip->source)));
done:
    gip_decoder_free(decoder);
    return result;
}

static int generate(VipsRegion *out, void *sequence, void *decoder, void *whole, gboolean *stop)
{
    const VipsRect *part = &out->valid;
    size_t stride = VIPS_REGION_LSKIP(out);
    gip_view view = *(const gip_view *)whole;

    view.region_x = (guint32)part->left;
    view.region_y = (guint32)part->top;
    view.region_width = (guint32)part->width;
    view.region_height = (guint32)part->height;
    if (gip_render(decoder, &view, VIPS_REGION_ADDR(out, part->left, part->top), stride,
                   stride * (size_t)(part->height - 1) + VIPS_REGION_SIZEOF_LINE(out))) {
        vips_error("gipload", "%s", gip_last_error());
        return -1;
    }
    return 0;
}

/* Feeds the file, or what of it the view takes. */
static gip_status feed(GipLoad *gip, gip_decoder *decoder)
{
    const size_t most = 1 << 14;
    gip_info info = gip_info_default();
    gboolean preview = gip->view.gaussians != 0 && gip->view.gaussians < gip->info.gaussians;
    size_t done, piece;

    for (done = 0; done < gip->size; done += piece) {
        piece = VIPS_MIN(most, gip->size - done);
        gip_status status = gip_decoder_feed(decoder, (const char *)gip->data + done, piece, NULL);

        if (status)
            return status;
        if (preview && !gip_decoder_info(decoder, &info) && info.decoded_gaussians >= gip->view.gaussians)
            return GIP_STATUS_OK;
    }
    return gip_decoder_finish(decoder, 0);
}

static int gip_load_load(VipsForeignLoad *load)
{
    GipLoad *gip = (GipLoad *)load;
    gip_decoder *decoder;
    gip_view *view;

    /* One that is fed renders for all threads of libvips at once, and shows what precedes damage. */
    if (gip_decoder_new(NULL, &decoder))
        return failed(gip);
    g_object_set_data_full(G_OBJECT(load->real), "gip-decoder", decoder, (GDestroyNotify)gip_decoder_free);
    if (feed(gip, decoder)) {
        gip_info info = gip_info_default();

        /* Of what has arrived there may be no picture. */
        if (load->fail_on >= VIPS_FAIL_ON_TRUNCATED || gip_decoder_info(decoder, &info) || info.decoded_gaussians == 0)
            return failed(gip);
        g_warning("%s", gip_last_error());
    }
    if (!(view = VIPS_NEW(load->real, gip_view)))
        return -1;
    *view = gip->view;
    return init_image(gip, load->real) || vips_image_generate(load->real, NULL, generate, NULL, decoder, view) ? -1 : 0;
}

static const char *suffixes[] = {".gip", NULL};

static void gip_load_class_init(GipLoadClass *class)
{
    VipsObjectClass *object_class = VIPS_OBJECT_CLASS(class);

    G_OBJECT_CLASS(class)->dispose = gip_load_dispose;
    take_properties(class);
    object_class->nickname = "gipload_base";
    object_class->description = "load .gip";
    class->get_flags = gip_load_get_flags;
    class->header = gip_load_header;
    class->load = gip_load_load;

    VIPS_ARG_DOUBLE(class, "scale", 20, "Scale", "Scale the picture by this factor while it is rendered",
                    VIPS_ARGUMENT_OPTIONAL_INPUT, G_STRUCT_OFFSET(GipLoad, scale), 0.001, 1000.0, 1.0);
}

static void gip_load_init(GipLoad *gip)
{
    gip->scale = 1.0;
}

static gboolean is_gip_source(VipsSource *source)
{
    const unsigned char *start = vips_source_sniff(source, 8);

    return start && gip_is_gip(start, 8);
}

static gboolean is_gip_buffer(const void *data, size_t size)
{
    return gip_is_gip(data, size);
}

static gboolean is_gip_file(const char *filename)
{
    VipsSource *source = vips_source_new_from_file(filename);
    gboolean is_gip = source && is_gip_source(source);

    VIPS_UNREF(source);
    return is_gip;
}

/* From a file. */

typedef struct {
    GipLoad parent;
    char *filename;
} GipLoadFile;

typedef GipLoadClass GipLoadFileClass;

G_DEFINE_TYPE(GipLoadFile, gip_load_file, gip_load_get_type())

static int gip_load_file_build(VipsObject *object)
{
    GipLoadFile *file = (GipLoadFile *)object;

    if (file->filename && !(file->parent.source = vips_source_new_from_file(file->filename)))
        return -1;
    return VIPS_OBJECT_CLASS(gip_load_file_parent_class)->build(object);
}

static void gip_load_file_class_init(GipLoadFileClass *class)
{
    take_properties(class);
    VIPS_OBJECT_CLASS(class)->nickname = "gipload";
    VIPS_OBJECT_CLASS(class)->build = gip_load_file_build;
    VIPS_FOREIGN_CLASS(class)->suffs = suffixes;
    class->is_a = is_gip_file;

    VIPS_ARG_STRING(class, "filename", 1, "Filename", "Filename to load from", VIPS_ARGUMENT_REQUIRED_INPUT,
                    G_STRUCT_OFFSET(GipLoadFile, filename), NULL);
}

static void gip_load_file_init(GipLoadFile *file)
{
}

/* From memory. */

typedef struct {
    GipLoad parent;
    VipsBlob *blob;
} GipLoadBuffer;

typedef GipLoadClass GipLoadBufferClass;

G_DEFINE_TYPE(GipLoadBuffer, gip_load_buffer, gip_load_get_type())

static int gip_load_buffer_build(VipsObject *object)
{
    GipLoadBuffer *buffer = (GipLoadBuffer *)object;

    if (buffer->blob) {
        size_t size;
        const void *data = vips_blob_get(buffer->blob, &size);

        if (!(buffer->parent.source = vips_source_new_from_memory(data, size)))
            return -1;
    }
    return VIPS_OBJECT_CLASS(gip_load_buffer_parent_class)->build(object);
}

static void gip_load_buffer_class_init(GipLoadBufferClass *class)
{
    take_properties(class);
    VIPS_OBJECT_CLASS(class)->nickname = "gipload_buffer";
    VIPS_OBJECT_CLASS(class)->build = gip_load_buffer_build;
    class->is_a_buffer = is_gip_buffer;

    VIPS_ARG_BOXED(class, "buffer", 1, "Buffer", "Buffer to load from", VIPS_ARGUMENT_REQUIRED_INPUT,
                   G_STRUCT_OFFSET(GipLoadBuffer, blob), VIPS_TYPE_BLOB);
}

static void gip_load_buffer_init(GipLoadBuffer *buffer)
{
}

/* From a source. */

typedef struct {
    GipLoad parent;
    VipsSource *source;
} GipLoadSource;

typedef GipLoadClass GipLoadSourceClass;

G_DEFINE_TYPE(GipLoadSource, gip_load_source, gip_load_get_type())

static int gip_load_source_build(VipsObject *object)
{
    GipLoadSource *from = (GipLoadSource *)object;

    if (from->source)
        from->parent.source = g_object_ref(from->source);
    return VIPS_OBJECT_CLASS(gip_load_source_parent_class)->build(object);
}

static void gip_load_source_class_init(GipLoadSourceClass *class)
{
    take_properties(class);
    VIPS_OBJECT_CLASS(class)->nickname = "gipload_source";
    VIPS_OBJECT_CLASS(class)->build = gip_load_source_build;
    /* What comes from a source is not the same the next time. */
    VIPS_OPERATION_CLASS(class)->flags |= VIPS_OPERATION_NOCACHE;
    class->is_a_source = is_gip_source;

    VIPS_ARG_OBJECT(class, "source", 1, "Source", "Source to load from", VIPS_ARGUMENT_REQUIRED_INPUT,
                    G_STRUCT_OFFSET(GipLoadSource, source), VIPS_TYPE_SOURCE);
}

static void gip_load_source_init(GipLoadSource *from)
{
}

void gip_module_load_types(void)
{
    gip_load_file_get_type();
    gip_load_buffer_get_type();
    gip_load_source_get_type();
}

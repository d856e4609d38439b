/* SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * gipsave, gipsave_buffer and gipsave_target. */
#include "module.h"

#include <gip.h>
#include <string.h>
#include <vips/vips.h>

typedef struct {
    VipsForeignSave parent;
    /* Where the file goes: one of the two. */
    char *filename;
    VipsTarget *target;
    int quality;
    int effort;
    int bytes;
    double psnr;
} GipSave;

typedef VipsForeignSaveClass GipSaveClass;

G_DEFINE_ABSTRACT_TYPE(GipSave, gip_save, VIPS_TYPE_FOREIGN_SAVE)

static void gip_save_dispose(GObject *object)
{
    VIPS_UNREF(((GipSave *)object)->target);
    G_OBJECT_CLASS(gip_save_parent_class)->dispose(object);
}

/* What each class needs that has properties of its own. */
static void take_properties(gpointer class)
{
    G_OBJECT_CLASS(class)->set_property = vips_object_set_property;
    G_OBJECT_CLASS(class)->get_property = vips_object_get_property;
}

static gip_blob blob_of(VipsImage *image, const char *name)
{
    gip_blob blob = {NULL, 0};
    const void *data;

    if (vips_image_get_typeof(image, name) && !vips_image_get_blob(image, name, &data, &blob.size))
        blob.data = data;
    return blob;
}

static guint32 number(const guint8 *bytes, int count, gboolean little)
{
    guint32 value = 0;
    int i;

    for (i = 0; i < count; i++)
        value = value << 8 | bytes[little ? count - 1 - i : i];
    return value;
}

/* Sets the orientation in Exif to upright, as the pixels are. */
static void set_upright(guint8 *exif, size_t size)
{
    gboolean little;
    size_t at, end;

    if (size >= 6 && !memcmp(exif, "Exif\0\0", 6)) {
        exif += 6;
        size -= 6;
    }
    if (size < 10)
        return;
    little = exif[0] == 'I';
    at = number(exif + 4, 4, little);
    if (at > size - 2)
        return;
    end = at + 2 + 12 * (size_t)number(exif + at, 2, little);
    for (at += 2; at < end && at + 12 <= size; at += 12) {
        if (number(exif + at, 2, little) == 0x112 && number(exif + at + 2, 2, little) == 3) {
            exif[at + 8] = little;
            exif[at + 9] = !little;
        }
    }
}

/* Cancels an encoding of which nobody wants the result. */
static int is_killed(const gip_progress *progress, void *image)
{
    return vips_image_iskilled(image);
}

static int gip_save_build(VipsObject *object)
{
    VipsForeignSave *save = (VipsForeignSave *)object;
    GipSave *gip = (GipSave *)object;
    VipsImage **t = (VipsImage **)vips_object_local_array(object, 3);
    VipsImage *upright;
    gip_source source = gip_source_default();
    gip_metadata metadata = gip_metadata_default();
    gip_encode_options options = gip_encode_options_default();
    gip_buffer file;
    guint8 *exif = NULL;
    void *pixels;
    gip_status status;
    int result;

    if (VIPS_OBJECT_CLASS(gip_save_parent_class)->build(object))
        return -1;
    /* A picture is stored upright, so that its orientation is not lost with its metadata. */
    if (!(t[0] = vips_image_copy_memory(save->ready)) || vips_autorot(t[0], &t[1], NULL))
        return -1;
    upright = t[1];
    /* Samples of 8 bits may be held in 16, as after an addition. What 16 mean, the interpretation says. */
    if (upright->BandFmt == VIPS_FORMAT_USHORT && upright->Type != VIPS_INTERPRETATION_RGB16
        && upright->Type != VIPS_INTERPRETATION_GREY16) {
        if (vips_cast(upright, &t[2], VIPS_FORMAT_UCHAR, NULL))
            return -1;
        upright = t[2];
    }
    if (!(pixels = vips_image_write_to_memory(upright, &source.size)))
        return -1;
    source.width = (guint32)upright->Xsize;
    source.height = (guint32)upright->Ysize;
    source.color = (guint32)upright->Bands;
    source.samples = upright->BandFmt == VIPS_FORMAT_USHORT ? GIP_SAMPLES_U16 : GIP_SAMPLES_U8;
    source.pixels = pixels;
    if (!save->strip) {
        metadata.icc = blob_of(upright, VIPS_META_ICC_NAME);
        metadata.xmp = blob_of(upright, VIPS_META_XMP_NAME);
        metadata.exif = blob_of(upright, VIPS_META_EXIF_NAME);
        if (metadata.exif.size > 0) {
            exif = g_malloc(metadata.exif.size);
            memcpy(exif, metadata.exif.data, metadata.exif.size);
            set_upright(exif, metadata.exif.size);
            metadata.exif.data = exif;
        }
        source.metadata = &metadata;
    }
    options.target = gip->bytes > 0 ? GIP_TARGET_BYTES : gip->psnr > 0.0 ? GIP_TARGET_PSNR : GIP_TARGET_QUALITY;
    options.value = gip->bytes > 0 ? gip->bytes : gip->psnr > 0.0 ? gip->psnr : gip->quality;
    options.effort = (guint32)gip->effort;
    options.threads = (guint32)vips_concurrency_get();
    options.progress = is_killed;
    options.user = save->in;
    status = gip_encode(&source, &options, &file, NULL);
    g_free(pixels);
    g_free(exif);
    if (status) {
        vips_error(VIPS_OBJECT_GET_CLASS(object)->nickname, "%s", gip_last_error());
        return -1;
    }
    /* Not before, as that empties a file that is there. */
    if (gip->filename)
        gip->target = vips_target_new_to_file(gip->filename);
    result = -1;
    if (gip->target && !vips_target_write(gip->target, file.data, file.size) && !vips_target_end(gip->target))
        result = 0;
    gip_buffer_free(&file);
    return result;
}

static const char *suffixes[] = {".gip", NULL};

/* 8 or 16 bits, for each format of libvips in its order. */
static VipsBandFormat formats[10] = {
    VIPS_FORMAT_UCHAR,  VIPS_FORMAT_UCHAR, VIPS_FORMAT_USHORT, VIPS_FORMAT_USHORT, VIPS_FORMAT_USHORT,
    VIPS_FORMAT_USHORT, VIPS_FORMAT_UCHAR, VIPS_FORMAT_UCHAR,  VIPS_FORMAT_UCHAR,  VIPS_FORMAT_UCHAR,
};

static void gip_save_class_init(GipSaveClass *class)
{
    VipsObjectClass *object_class = VIPS_OBJECT_CLASS(class);

    G_OBJECT_CLASS(class)->dispose = gip_save_dispose;
    take_properties(class);
    object_class->nickname = "gipsave_base";
    object_class->description = "save .gip";
    object_class->build = gip_save_build;
    VIPS_FOREIGN_CLASS(class)->suffs = suffixes;
    class->saveable = VIPS_SAVEABLE_RGBA;
    class->format_table = formats;

    VIPS_ARG_INT(class, "Q", 10, "Q", "Quality, on the scale of SSIMULACRA2", VIPS_ARGUMENT_OPTIONAL_INPUT,
                 G_STRUCT_OFFSET(GipSave, quality), 0, 100, 75);
    VIPS_ARG_INT(class, "effort", 11, "Effort", "Time to spend, 1 (least) to 7 (most)", VIPS_ARGUMENT_OPTIONAL_INPUT,
                 G_STRUCT_OFFSET(GipSave, effort), 1, 7, 4);
    VIPS_ARG_INT(class, "bytes", 12, "Bytes", "Most bytes of the file, in place of a quality",
                 VIPS_ARGUMENT_OPTIONAL_INPUT, G_STRUCT_OFFSET(GipSave, bytes), 0, 1 << 30, 0);
    VIPS_ARG_DOUBLE(class, "psnr", 13, "PSNR", "PSNR in dB, in place of a quality", VIPS_ARGUMENT_OPTIONAL_INPUT,
                    G_STRUCT_OFFSET(GipSave, psnr), 0.0, 120.0, 0.0);
}

static void gip_save_init(GipSave *gip)
{
    gip->quality = 75;
    gip->effort = 4;
}

/* To a file. */

typedef GipSave GipSaveFile;

typedef GipSaveClass GipSaveFileClass;

G_DEFINE_TYPE(GipSaveFile, gip_save_file, gip_save_get_type())

static void gip_save_file_class_init(GipSaveFileClass *class)
{
    take_properties(class);
    VIPS_OBJECT_CLASS(class)->nickname = "gipsave";

    VIPS_ARG_STRING(class, "filename", 1, "Filename", "Filename to save to", VIPS_ARGUMENT_REQUIRED_INPUT,
                    G_STRUCT_OFFSET(GipSaveFile, filename), NULL);
}

static void gip_save_file_init(GipSaveFile *file)
{
}

/* To memory. */

typedef struct {
    GipSave parent;
    VipsArea *blob;
} GipSaveBuffer;

typedef GipSaveClass GipSaveBufferClass;

G_DEFINE_TYPE(GipSaveBuffer, gip_save_buffer, gip_save_get_type())

static int gip_save_buffer_build(VipsObject *object)
{
    GipSaveBuffer *buffer = (GipSaveBuffer *)object;
    VipsBlob *blob;

    if (!(buffer->parent.target = vips_target_new_to_memory()))
        return -1;
    if (VIPS_OBJECT_CLASS(gip_save_buffer_parent_class)->build(object))
        return -1;
    g_object_get(buffer->parent.target, "blob", &blob, NULL);
    g_object_set(buffer, "buffer", blob, NULL);
    vips_area_unref(VIPS_AREA(blob));
    return 0;
}

static void gip_save_buffer_class_init(GipSaveBufferClass *class)
{
    take_properties(class);
    VIPS_OBJECT_CLASS(class)->nickname = "gipsave_buffer";
    VIPS_OBJECT_CLASS(class)->build = gip_save_buffer_build;

    VIPS_ARG_BOXED(class, "buffer", 1, "Buffer", "Buffer to save to", VIPS_ARGUMENT_REQUIRED_OUTPUT,
                   G_STRUCT_OFFSET(GipSaveBuffer, blob), VIPS_TYPE_BLOB);
}

static void gip_save_buffer_init(GipSaveBuffer *buffer)
{
}

/* To a target. */

typedef struct {
    GipSave parent;
    VipsTarget *target;
} GipSaveTarget;

typedef GipSaveClass GipSaveTargetClass;

G_DEFINE_TYPE(GipSaveTarget, gip_save_target, gip_save_get_type())

static int gip_save_target_build(VipsObject *object)
{
    GipSaveTarget *to = (GipSaveTarget *)object;

    if (to->target)
        to->parent.target = g_object_ref(to->target);
    return VIPS_OBJECT_CLASS(gip_save_target_parent_class)->build(object);
}

static void gip_save_target_class_init(GipSaveTargetClass *class)
{
    take_properties(class);
    VIPS_OBJECT_CLASS(class)->nickname = "gipsave_target";
    VIPS_OBJECT_CLASS(class)->build = gip_save_target_build;

    VIPS_ARG_OBJECT(class, "target", 1, "Target", "Target to save to", VIPS_ARGUMENT_REQUIRED_INPUT,
                    G_STRUCT_OFFSET(GipSaveTarget, target), VIPS_TYPE_TARGET);
}

static void gip_save_target_init(GipSaveTarget *to)
{
}

void gip_module_save_types(void)
{
    gip_save_file_get_type();
    gip_save_buffer_get_type();
    gip_save_target_get_type();
}

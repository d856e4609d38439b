/*
 * gip.h: the C library of .gip, pictures stored as 2D Gaussians. Generated from bindings/c/src.
 * SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * Errors. Functions return a gip_status, and gip_last_error() says in words what was wrong. Pointers that
 * are null or not aligned, numbers that are out of range, unknown flags and sizes that do not fit are
 * refused with GIP_STATUS_ARGUMENT. All else that a pointer must be, the caller warrants: that it points to
 * an object of its type, of the size that is given, for as long as the text of the function says.
 *
 * Structures begin with struct_size, so that later versions can add fields at their end. gip_view_default()
 * and so on make one whose size is set and whose other fields are 0, which is the default of each. A library
 * takes structures of programs with an older header, and of those with a newer header as long as the fields
 * that it does not know are 0.
 *
 * Memory. What a function hands over is freed by the function that its text names; all else belongs to the
 * caller. The library keeps no pointer of the caller beyond a call, except to the file of gip_decoder_open.
 * Where memory for its own data runs out, the library ends the program; limits bound what a file can take.
 *
 * Threads. All functions may be called on any thread, and on several at the same time, also with the same
 * decoder, but an object is freed once, when no call uses it any more, and structures of the caller must not
 * change during a call. gip_last_error() is of the thread that calls it. Threads of the library live as long
 * as the call that has started them, so programs may fork between calls.
 */

#ifndef GIP_H
#define GIP_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

/**
 * The version of the binary interface that this header declares. It grows when a program that was
 * compiled with an older header could not use the library, and is the number in the library's soname.
 */
#define GIP_ABI_VERSION 1

/**
 * The version of the library that this header belongs to: the first of its three numbers.
 */
#define GIP_VERSION_MAJOR 0

/**
 * The second number.
 */
#define GIP_VERSION_MINOR 9

/**
 * The third number.
 */
#define GIP_VERSION_PATCH 0

/**
 * gip_metadata.cicp is there.
 */
#define GIP_METADATA_CICP 1

/**
 * gip_metadata.mastering_display is there.
 */
#define GIP_METADATA_MASTERING_DISPLAY 2

/**
 * gip_metadata.content_light is there.
 */
#define GIP_METADATA_CONTENT_LIGHT 4

/**
 * For gip_view.flags: leaves out the texture of the picture, the noise in place of sand, water or leaves.
 * Without it the picture is smoother, and nearer to the source sample by sample.
 */
#define GIP_VIEW_NO_TEXTURE 1

/**
 * For gip_encode_options.flags: keeps colours where alpha is 0. By default what does not show takes the
 * colours around it: the file is smaller, and scaled pictures have no fringes.
 */
#define GIP_ENCODE_KEEP_INVISIBLE 1

/**
 * For gip_encode_options.texture: no texture.
 */
#define GIP_TEXTURE_NONE -1

/**
 * For gip_report.metadata_losses: a colour profile other than that of sRGB was dropped.
 */
#define GIP_LOSS_COLOR_PROFILE 1

/**
 * An orientation other than upright was dropped.
 */
#define GIP_LOSS_ORIENTATION 2

/**
 * The Exif data are damaged: what could be read of them is kept.
 */
#define GIP_LOSS_DAMAGED_EXIF 4

/**
 * The XMP packet is damaged, and was dropped.
 */
#define GIP_LOSS_DAMAGED_XMP 8

/**
 * How a call has ended. gip_last_error says more about a failure.
 */
enum gip_status
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * It has done what it is for.
     */
    GIP_STATUS_OK = 0,
    /**
     * An argument is null, out of range, or does not fit the others or the picture. Nothing was done.
     */
    GIP_STATUS_ARGUMENT = 1,
    /**
     * The bytes are not those of a .gip file.
     */
    GIP_STATUS_SIGNATURE = 2,
    /**
     * The file breaks a rule of the format.
     */
    GIP_STATUS_MALFORMED = 3,
    /**
     * The file requires something that this library does not have, such as a later version of the format.
     */
    GIP_STATUS_UNSUPPORTED = 4,
    /**
     * The file ends too early.
     */
    GIP_STATUS_UNEXPECTED_END = 5,
    /**
     * The file or the output requires more than a limit allows.
     */
    GIP_STATUS_LIMIT = 6,
    /**
     * The bytes so far do not suffice: call again after gip_decoder_feed.
     */
    GIP_STATUS_NEED_MORE = 7,
    /**
     * The callback has cancelled the encoding.
     */
    GIP_STATUS_CANCELLED = 8,
    /**
     * There is no memory for a copy of the samples.
     */
    GIP_STATUS_MEMORY = 9,
    /**
     * The threads could not be started.
     */
    GIP_STATUS_THREADS = 10,
    /**
     * The library has an error of its own. The objects of the call can only be freed.
     */
    GIP_STATUS_INTERNAL = 11,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum gip_status gip_status;
#else
typedef int32_t gip_status;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * The channels of a picture, in the order of its samples. The number is that of channels. Colours are sRGB
 * unless metadata say otherwise; alpha is straight (colours are not multiplied by it) and linear.
 */
enum gip_color
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * Those of the file.
     */
    GIP_COLOR_FILE = 0,
    /**
     * One channel.
     */
    GIP_COLOR_GRAY = 1,
    /**
     * Gray and alpha.
     */
    GIP_COLOR_GRAY_ALPHA = 2,
    /**
     * Red, green, blue.
     */
    GIP_COLOR_RGB = 3,
    /**
     * Red, green, blue, alpha.
     */
    GIP_COLOR_RGBA = 4,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum gip_color gip_color;
#else
typedef uint32_t gip_color;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * The type of samples, and how they are stored. Pixels stand in rows from the top, from left to right.
 * Numbers of several bytes are those of the machine.
 */
enum gip_samples
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * GIP_SAMPLES_U8 or _U16, as the file says.
     */
    GIP_SAMPLES_FILE = 0,
    /**
     * uint8_t, 0 to 255; all samples of a pixel together.
     */
    GIP_SAMPLES_U8 = 1,
    /**
     * uint16_t, 0 to 65535; all samples of a pixel together.
     */
    GIP_SAMPLES_U16 = 2,
    /**
     * float, where 1.0 is a full sample; all samples of a pixel together. They are neither clamped nor
     * rounded, unless composed: in black and white parts they may be far outside of 0 to 1.
     */
    GIP_SAMPLES_F32 = 3,
    /**
     * As GIP_SAMPLES_F32, but in planes: all rows of the first channel, then all of the second, and so on.
     */
    GIP_SAMPLES_F32_PLANES = 4,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum gip_samples gip_samples;
#else
typedef uint32_t gip_samples;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * What gip_encode_options.value is that a file has to meet.
 */
enum gip_target
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * A picture that a person accepts without looking twice: a quality of 75. The value is not looked at.
     */
    GIP_TARGET_AUTO = 0,
    /**
     * A visual quality, 0 to 100, on the scale of SSIMULACRA2: about 50 is medium, 70 high, and from 90 on
     * people see no difference. No more than 97 is aimed at.
     */
    GIP_TARGET_QUALITY = 1,
    /**
     * At most so many bytes, a whole number from 1 to 2^30.
     */
    GIP_TARGET_BYTES = 2,
    /**
     * At most so many bits per pixel, 1e-6 to 1e6.
     */
    GIP_TARGET_BITS_PER_PIXEL = 3,
    /**
     * A PSNR of the decoded file without its texture in dB, 1 to 120.
     */
    GIP_TARGET_PSNR = 4,
    /**
     * At most so many Gaussians, a whole number from 1 to 2^22.
     */
    GIP_TARGET_GAUSSIANS = 5,
    /**
     * A Lagrange multiplier, 0.01 to 1e6: the squared error that a bit must save, where samples are 0 to
     * 255. All files of a set at the same one have the least error for their size.
     */
    GIP_TARGET_LAMBDA = 6,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum gip_target gip_target;
#else
typedef uint32_t gip_target;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * What to minimize for the size of a file.
 */
enum gip_tune
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * The error that a person sees.
     */
    GIP_TUNE_VISUAL = 0,
    /**
     * The squared error, without texture.
     */
    GIP_TUNE_PSNR = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum gip_tune gip_tune;
#else
typedef uint32_t gip_tune;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * How Gaussians are stored.
 */
enum gip_precision
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * Entropy coding, for the smallest files.
     */
    GIP_PRECISION_ENTROPY = 0,
    /**
     * Codes of fixed bit depths.
     */
    GIP_PRECISION_PACKED = 1,
    /**
     * The fitted values themselves, in files several times as large.
     */
    GIP_PRECISION_F32 = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum gip_precision gip_precision;
#else
typedef uint32_t gip_precision;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * What of the metadata of a source is stored.
 */
enum gip_metadata_policy
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * All of it.
     */
    GIP_METADATA_POLICY_ALL = 0,
    /**
     * Profile, orientation, resolution, copyright, artist, description and dates. Position, maker notes,
     * thumbnails, serial numbers, names of owners, comments and all else are dropped.
     */
    GIP_METADATA_POLICY_SAFE = 1,
    /**
     * Nothing but codes of colours: cicp, mastering_display and content_light.
     */
    GIP_METADATA_POLICY_NONE = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum gip_metadata_policy gip_metadata_policy;
#else
typedef uint32_t gip_metadata_policy;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Why a file does not meet its target. It comes as close as it can.
 */
enum gip_shortfall
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * It meets it, within 1 % of a size, 0.05 dB of a PSNR and 1 of a quality.
     */
    GIP_SHORTFALL_NONE = 0,
    /**
     * The PSNR is below the target: this is what the effort and the precision reach.
     */
    GIP_SHORTFALL_PSNR_BELOW = 1,
    /**
     * The PSNR is above the target even with these few Gaussians.
     */
    GIP_SHORTFALL_PSNR_ABOVE = 2,
    /**
     * The quality is below the target: this is what the effort and the precision reach.
     */
    GIP_SHORTFALL_QUALITY_BELOW = 3,
    /**
     * The quality is about the highest that is aimed at.
     */
    GIP_SHORTFALL_QUALITY_CAPPED = 4,
    /**
     * The quality is above the target even with these few Gaussians.
     */
    GIP_SHORTFALL_QUALITY_ABOVE = 5,
    /**
     * The file has no Gaussian, and is larger than the target all the same.
     */
    GIP_SHORTFALL_SIZE_ABOVE = 6,
    /**
     * A file of the target's size shows no better picture at this effort than this smaller one.
     */
    GIP_SHORTFALL_SIZE_USELESS = 7,
    /**
     * The file is smaller: the picture needs no more, or the next Gaussian would not fit.
     */
    GIP_SHORTFALL_SIZE_BELOW = 8,
    /**
     * The file is smaller, and the picture could be better, but this effort finds no use for more bytes.
     */
    GIP_SHORTFALL_SIZE_UNUSED = 9,
    /**
     * Another reason, of a later version of the library.
     */
    GIP_SHORTFALL_OTHER = 10,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum gip_shortfall gip_shortfall;
#else
typedef uint32_t gip_shortfall;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * A decoder of one file. Several threads may call functions with the same decoder at the same time, but
 * for gip_decoder_free. They wait for each other, except that a decoder which is fed renders for all of
 * them at once.
 */
typedef struct gip_decoder gip_decoder;

/**
 * Bytes that the library has allocated. gip_buffer_free frees them, and nothing else does.
 */
typedef struct gip_buffer {
    /**
     * The bytes; null if there are none.
     */
    uint8_t *data;
    /**
     * How many they are.
     */
    size_t size;
} gip_buffer;

/**
 * What a decoder spends on a file at most, and what a file that is encoded may require of decoders. Each
 * limit is checked before the memory is allocated or the work is done. 0 is the default of each; the
 * largest number of its type is no limit. The defaults accept every ordinary picture, and bound what a
 * hostile file costs to a few hundred megabytes and a few seconds.
 */
typedef struct gip_limits {
    /**
     * sizeof(gip_limits).
     */
    size_t struct_size;
    /**
     * Largest width in pixels, of the file and of what is rendered. Default 65536.
     */
    uint32_t max_width;
    /**
     * Largest height in pixels, of the file and of what is rendered. Default 65536.
     */
    uint32_t max_height;
    /**
     * Most pixels, of the file and of what is rendered. Default 2^28.
     */
    uint64_t max_pixels;
    /**
     * Most bytes that the decoder and the renderer may hold at any time, without the output. Default 2^29.
     */
    uint64_t max_memory;
    /**
     * Most kernel evaluations in one rendering beyond 64 for each pixel that is rendered, which is more
     * than ordinary pictures take. Default 2^32, a few seconds on one core.
     */
    uint64_t max_work;
    /**
     * Most Gaussians. Default 2^22.
     */
    uint32_t max_gaussians;
} gip_limits;

/**
 * One Gaussian of a picture. At a point whose squared Mahalanobis distance from the centre is q, it adds
 * the colour times the weight of q, which gip_info.cutoff tells, to gip_info.base_color.
 */
typedef struct gip_gaussian {
    /**
     * Centre in pixels of the stored size: x to the right, y down. That of the first pixel is 0.5, 0.5.
     */
    float center[2];
    /**
     * The lower triangular Cholesky factor l11, l21, l22 of the covariance, in pixels of the stored size.
     */
    float cholesky[3];
    /**
     * Amplitude in each channel, where 1.0 is a full sample; may be negative. 0 in channels that the
     * picture lacks.
     */
    float color[4];
} gip_gaussian;

/**
 * What is known of a picture.
 */
typedef struct gip_info {
    /**
     * sizeof(gip_info).
     */
    size_t struct_size;
    /**
     * Width in pixels as stored, 1 to 2^20.
     */
    uint32_t width;
    /**
     * Height in pixels as stored, 1 to 2^20.
     */
    uint32_t height;
    /**
     * The channels: GIP_COLOR_GRAY, _GRAY_ALPHA, _RGB or _RGBA. This is also their number.
     */
    uint32_t color;
    /**
     * Bits of a sample of the picture that was encoded: 8 or 16.
     */
    uint32_t depth;
    /**
     * How the picture is turned for display, as a value of Exif: 1 (upright as stored) to 8; from 5 on,
     * rows become columns. 0 if it is not known yet. It is always known when the first layer has arrived.
     */
    uint32_t orientation;
    /**
     * 1 if the whole file has been read, else 0.
     */
    uint32_t is_complete;
    /**
     * Gaussians in the whole file.
     */
    uint32_t gaussians;
    /**
     * Layers in the whole file.
     */
    uint32_t layers;
    /**
     * Gaussians that are decoded. Of a file in memory, gip_decoder_finish decodes all.
     */
    uint32_t decoded_gaussians;
    /**
     * Layers that are decoded.
     */
    uint32_t decoded_layers;
    /**
     * Parts so far that break a rule of the format and were skipped: see gip_decoder_skipped.
     */
    uint32_t skipped;
    /**
     * The version of the format, 1.
     */
    uint32_t version;
    /**
     * The colour that the Gaussians are added to, where 65535 is a full sample; 0 in channels that the
     * picture lacks.
     */
    uint16_t base_color[4];
    /**
     * The kernel of the Gaussians, the weight at a squared Mahalanobis distance q: 0 for the usual one,
     * (1 - q / 4)^2 up to q = 4; else exp(-q / 2) up to this q.
     */
    float cutoff;
} gip_info;

/**
 * Bytes of somebody else. A size of 0, whatever the pointer is, stands for what is not there.
 */
typedef struct gip_blob {
    /**
     * The bytes.
     */
    const uint8_t *data;
    /**
     * How many they are.
     */
    size_t size;
} gip_blob;

/**
 * A keyword and its text, both in UTF-8 with a NUL at the end.
 */
typedef struct gip_text {
    /**
     * The keyword, 1 to 79 bytes, such as "Title", "Author" or "Copyright".
     */
    const char *keyword;
    /**
     * The text.
     */
    const char *text;
} gip_text;

/**
 * A colour space, as codes of Rec. ITU-T H.273. Samples are RGB in full range, or gray.
 */
typedef struct gip_cicp {
    /**
     * ColourPrimaries: 1 for sRGB and BT.709, 9 for BT.2020, 12 for Display P3.
     */
    uint8_t primaries;
    /**
     * TransferCharacteristics: 13 for sRGB, 16 for PQ, 18 for HLG.
     */
    uint8_t transfer;
} gip_cicp;

/**
 * The display on which a picture was made (SMPTE ST 2086).
 */
typedef struct gip_mastering_display {
    /**
     * CIE 1931 x and y of its red, in 0.00002.
     */
    uint16_t red[2];
    /**
     * x and y of its green, in 0.00002.
     */
    uint16_t green[2];
    /**
     * x and y of its blue, in 0.00002.
     */
    uint16_t blue[2];
    /**
     * x and y of its white, in 0.00002.
     */
    uint16_t white[2];
    /**
     * The most luminance that it shows, in 0.0001 cd/m^2.
     */
    uint32_t max_luminance;
    /**
     * The least luminance that it shows, in 0.0001 cd/m^2.
     */
    uint32_t min_luminance;
} gip_mastering_display;

/**
 * How bright a picture is (CTA-861).
 */
typedef struct gip_content_light {
    /**
     * MaxCLL, that of the brightest pixel, in 0.0001 cd/m^2; 0 if it is not known.
     */
    uint32_t max_content;
    /**
     * MaxFALL, the mean of the picture, in 0.0001 cd/m^2; 0 if it is not known.
     */
    uint32_t max_frame_average;
} gip_content_light;

/**
 * The metadata of a picture: of a file that is decoded, or of one to be encoded. It is passed on as it is
 * stored, and does not change the samples.
 */
typedef struct gip_metadata {
    /**
     * sizeof(gip_metadata).
     */
    size_t struct_size;
    /**
     * The ICC profile of the colours. Without one, and without cicp, they are sRGB.
     */
    struct gip_blob icc;
    /**
     * Exif data: a TIFF stream, which begins with II or MM. Of a file to be encoded, the prefix that it has
     * in JPEG may come before.
     */
    struct gip_blob exif;
    /**
     * An XMP packet: XML in UTF-8.
     */
    struct gip_blob xmp;
    /**
     * Keywords and their texts, in the order of the file.
     */
    const struct gip_text *texts;
    /**
     * How many there are.
     */
    size_t text_count;
    /**
     * Which of the following fields are there: GIP_METADATA_CICP and so on, combined by |.
     */
    uint32_t present;
    /**
     * The colour space. It counts before the ICC profile.
     */
    struct gip_cicp cicp;
    /**
     * The display on which the picture was made.
     */
    struct gip_mastering_display mastering_display;
    /**
     * How bright the picture is.
     */
    struct gip_content_light content_light;
} gip_metadata;

/**
 * What to render. 0 in every field is the whole picture as it is stored, on the thread of the caller.
 *
 * Sizes and regions are of the picture as stored; gip_info.orientation tells how to turn it for display.
 */
typedef struct gip_view {
    /**
     * sizeof(gip_view).
     */
    size_t struct_size;
    /**
     * Width of the whole output in pixels, 1 to 2^23; 0 in both is the stored size. A larger output
     * is evaluated at the centres of its pixels, a smaller one is the average by area: no pixels
     * are resampled.
     */
    uint32_t width;
    /**
     * Height of the whole output in pixels.
     */
    uint32_t height;
    /**
     * First column of the region of the output to render.
     */
    uint32_t region_x;
    /**
     * First row of the region.
     */
    uint32_t region_y;
    /**
     * Width of the region in pixels; 0 in all four is the whole output. A region has the
     * samples of the whole output, bit for bit.
     */
    uint32_t region_width;
    /**
     * Height of the region in pixels.
     */
    uint32_t region_height;
    /**
     * The channels to render, a gip_color. Gray can become RGB, and alpha can be added. If the picture has
     * alpha and this has not, it is composed over the background. Colours do not become gray.
     */
    uint32_t color;
    /**
     * The type of samples, a gip_samples.
     */
    uint32_t samples;
    /**
     * Renders only so many Gaussians, the first of the file, which are the strongest; 0 is all. See
     * gip_decoder_gaussians_for.
     */
    uint32_t gaussians;
    /**
     * 0, or GIP_VIEW_NO_TEXTURE.
     */
    uint32_t flags;
    /**
     * Number of threads, 0 to 1024, which end before the call does; 0 and 1 are that of the caller. The
     * samples do not depend on it.
     */
    uint32_t threads;
    /**
     * Red, green and blue of the background, where 65535 is a full sample; gray takes the first. Default
     * black. Composed are the samples that show, clamped and not linear, as in browsers.
     */
    uint16_t background[3];
} gip_view;

/**
 * What gip_render writes for a view.
 */
typedef struct gip_output {
    /**
     * sizeof(gip_output).
     */
    size_t struct_size;
    /**
     * Width in pixels.
     */
    uint32_t width;
    /**
     * Height in pixels.
     */
    uint32_t height;
    /**
     * The channels, a gip_color other than GIP_COLOR_FILE, which is also their number.
     */
    uint32_t color;
    /**
     * The type of samples, a gip_samples other than GIP_SAMPLES_FILE.
     */
    uint32_t samples;
    /**
     * Bytes of a row without padding: the least stride.
     */
    size_t row_size;
    /**
     * Bytes of all rows without padding.
     */
    size_t size;
} gip_output;

/**
 * A picture to encode. The library copies nothing of it but for rows with padding and floats; all that it
 * points to must remain as it is during the call.
 */
typedef struct gip_source {
    /**
     * sizeof(gip_source).
     */
    size_t struct_size;
    /**
     * Width in pixels, 1 to 2^20.
     */
    uint32_t width;
    /**
     * Height in pixels, 1 to 2^20.
     */
    uint32_t height;
    /**
     * The channels, a gip_color other than GIP_COLOR_FILE.
     */
    uint32_t color;
    /**
     * The type of samples: GIP_SAMPLES_U8, _U16, or _F32, whose values are 0 to 1 and which are stored as
     * pictures of 16 bits.
     */
    uint32_t samples;
    /**
     * The samples: rows from the top, aligned for their type.
     */
    const void *pixels;
    /**
     * Bytes from a row to the next, a whole number of samples; 0 stands for rows without padding.
     */
    size_t stride;
    /**
     * Bytes of all rows; the last one needs no padding.
     */
    size_t size;
    /**
     * What to store with the picture; null for nothing.
     */
    const struct gip_metadata *metadata;
} gip_source;

/**
 * The progress of an encoding.
 */
typedef struct gip_progress {
    /**
     * The bytes of the structure that the library has filled: those of its version of the header.
     */
    size_t struct_size;
    /**
     * The share of the work that is done, 0 to 1: an estimate, which never falls.
     */
    double fraction;
    /**
     * PSNR in dB of the Gaussians so far.
     */
    double psnr;
    /**
     * Iterations of training done so far.
     */
    uint32_t iteration;
    /**
     * Iterations planned in total; the number may grow.
     */
    uint32_t iterations;
    /**
     * Gaussians so far.
     */
    uint32_t gaussians;
} gip_progress;

/**
 * Is called again and again during gip_encode, on the thread that has called it, with the progress and with
 * gip_encode_options.user. It returns 0 to go on; anything else cancels the encoding. It must return: no
 * exception and no longjmp may leave it.
 */
typedef int (*gip_progress_function)(const struct gip_progress *progress, void *user);

/**
 * How to encode. 0 in every field is the default. The file depends on the source and on these options
 * alone, not on threads.
 */
typedef struct gip_encode_options {
    /**
     * sizeof(gip_encode_options).
     */
    size_t struct_size;
    /**
     * What the file has to meet, a gip_target.
     */
    uint32_t target;
    /**
     * What to minimize, a gip_tune.
     */
    uint32_t tune;
    /**
     * The number that the target is about.
     */
    double value;
    /**
     * How much time to spend, 1 (least) to 7 (most); each takes twice as long as the one before. Default 4.
     */
    uint32_t effort;
    /**
     * How Gaussians are stored, a gip_precision.
     */
    uint32_t precision;
    /**
     * Strength of the texture, 1 to 100, or GIP_TEXTURE_NONE; default 50. It takes the place of fine
     * irregular detail that the file has no bits for, such as sand, water and leaves.
     */
    int32_t texture;
    /**
     * Most bytes of the file that the first layer makes, 80 to 65536: a placeholder, with which the whole
     * file begins, and which gip_prefix cuts off. Default: a tenth of the file, about.
     */
    uint32_t first_layer;
    /**
     * The seed of all random numbers.
     */
    uint64_t seed;
    /**
     * Number of threads that work, 0 to 1024; 0 is 1. The calling thread waits for them, and they end
     * before the call does.
     */
    uint32_t threads;
    /**
     * 0, or GIP_ENCODE_KEEP_INVISIBLE.
     */
    uint32_t flags;
    /**
     * What of the metadata is stored, a gip_metadata_policy.
     */
    uint32_t metadata_policy;
    /**
     * Those of the decoder that is to read the file: what it would refuse is not encoded. Null for the
     * defaults, with which every decoder reads the file that is not told otherwise.
     */
    const struct gip_limits *limits;
    /**
     * What is called meanwhile; null for nothing.
     */
    gip_progress_function progress;
    /**
     * What it is called with.
     */
    void *user;
} gip_encode_options;

/**
 * What an encoding has achieved and cost.
 */
typedef struct gip_report {
    /**
     * sizeof(gip_report).
     */
    size_t struct_size;
    /**
     * PSNR in dB of the decoded file without its texture against the source, at the depth of the source;
     * infinite for an exact copy.
     */
    double psnr;
    /**
     * The same of samples that are clamped but not rounded, as papers report it.
     */
    double psnr_float;
    /**
     * An estimate of the visual quality of the decoded file without its texture, 0 to 100: the score of
     * SSIMULACRA2, within about 2.
     */
    double quality;
    /**
     * Wall-clock time in seconds.
     */
    double seconds;
    /**
     * Most bytes that the buffers of the encoder took at one time, without source and file.
     */
    uint64_t peak_memory;
    /**
     * Bytes of the texture in the file.
     */
    uint64_t texture_size;
    /**
     * Gaussians in the file, without those of the texture.
     */
    uint32_t gaussians;
    /**
     * Gaussians of the texture; 0 if there is none.
     */
    uint32_t texture_gaussians;
    /**
     * Iterations of training.
     */
    uint32_t iterations;
    /**
     * Why the file does not meet its target, a gip_shortfall.
     */
    uint32_t shortfall;
    /**
     * What of the metadata was dropped that may be missed: GIP_LOSS_COLOR_PROFILE and so on, combined by |.
     */
    uint32_t metadata_losses;
} gip_report;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * Returns what was wrong in the last call of this thread that has failed, as an English text in UTF-8 for
 * people; an empty text if none has. It is valid until the next call of this thread that fails. The texts
 * may change in any release.
 */
const char *gip_last_error(void);

/**
 * Returns the version of the binary interface of the library that runs, which is GIP_ABI_VERSION of its
 * header. A program that loads the library by itself compares the two.
 */
uint32_t gip_abi_version(void);

/**
 * Returns the version of the library that runs, such as "1.2.3". The text is never freed.
 */
const char *gip_version(void);

/**
 * Returns 1 if a file that begins with these bytes is a .gip file, of any version, and 0 if it is none or
 * if there are fewer than 8 bytes, or `data` is null. More than 8 are not looked at.
 */
int gip_is_gip(const void *data,
               size_t size);

/**
 * Frees the bytes of a buffer, and makes it an empty one. Null and an empty buffer are left alone.
 */
void gip_buffer_free(struct gip_buffer *buffer);

/**
 * Makes a decoder for a file that arrives in pieces: see gip_decoder_feed.
 *
 * `limits` may be null for the defaults. `*decoder` is set to the new decoder, to be freed with
 * gip_decoder_free, or to null on failure.
 */
gip_status gip_decoder_new(const struct gip_limits *limits, struct gip_decoder **decoder);

/**
 * Makes a decoder for a whole file of `size` bytes in memory, and reads it up to its first layer. This is
 * the fast way: several threads decode layers, those that do not show in a region are skipped, and for
 * gip_view.gaussians no more is read than these take.
 *
 * The bytes are not copied: they must remain as they are until the last use of the decoder before
 * gip_decoder_free. `limits` may be null for the defaults. `*decoder` is set to the new decoder, or to null
 * on failure: for a file that is damaged before its first layer.
 */
gip_status gip_decoder_open(const void *data,
                            size_t size,
                            const struct gip_limits *limits,
                            struct gip_decoder **decoder);

/**
 * Frees a decoder, and all that its functions have pointed to. Null is left alone.
 */
void gip_decoder_free(struct gip_decoder *decoder);

/**
 * Takes the next `size` bytes of a file, of which there may be any number, and copies what it needs of
 * them. Every layer is decoded as soon as its last byte has arrived, on this thread; gip_render shows what
 * has arrived.
 *
 * `used` may be null; else it is set to how many of the bytes belong to the file: all, unless the file ends
 * within them; 0 on failure. After a failure for what the file is (GIP_STATUS_SIGNATURE, _MALFORMED, _UNSUPPORTED,
 * _LIMIT) the decoder takes no more bytes and fails again in the same way, but gip_render still shows the
 * Gaussians before the error.
 */
gip_status gip_decoder_feed(struct gip_decoder *decoder,
                            const void *data,
                            size_t size,
                            size_t *used);

/**
 * Says that the file is all there. Fails with GIP_STATUS_UNEXPECTED_END if it is not.
 *
 * Of a file in memory, this reads all that is left, on `threads` threads as in gip_view, and keeps it
 * decoded: renderings of many regions, one after the other, are faster then. Where the file is damaged, it
 * fails, and gip_decoder_feed of another decoder gives what can be shown of it.
 */
gip_status gip_decoder_finish(struct gip_decoder *decoder,
                              uint32_t threads);

/**
 * Sets `*gaussians` to how many Gaussians suffice for a preview with this size of the whole output in
 * pixels, which is a value for gip_view.gaussians: a sixth of all where that is one for 16 pixels, and all
 * otherwise. Fails with GIP_STATUS_NEED_MORE if the header has not arrived.
 */
gip_status gip_decoder_gaussians_for(const struct gip_decoder *decoder,
                                     uint32_t width,
                                     uint32_t height,
                                     uint32_t *gaussians);

/**
 * Returns what was wrong with part number `index` of those that break a rule of the format, and were
 * skipped because the picture can be shown without them, such as a second ICC profile. It is an English
 * text in UTF-8 for people, or null if there are no more. gip_info.skipped has their number, at most 16.
 * The text is valid until the decoder is fed or freed.
 */
const char *gip_decoder_skipped(struct gip_decoder *decoder,
                                size_t index);

/**
 * Copies the Gaussians that are decoded, from number `first` on and at most `count` of them, to
 * `gaussians`, in the order of the file. gip_info.decoded_gaussians has their number. `copied` is set to
 * how many were copied.
 */
gip_status gip_decoder_gaussians(const struct gip_decoder *decoder,
                                 size_t first,
                                 size_t count,
                                 struct gip_gaussian *gaussians,
                                 size_t *copied);

/**
 * Fills `info`, whose struct_size is set. Fails with GIP_STATUS_NEED_MORE if the header has not arrived;
 * that of a file in memory always has.
 */
gip_status gip_decoder_info(const struct gip_decoder *decoder,
                            struct gip_info *info);

/**
 * Fills `metadata`, whose struct_size is set, with what has arrived. Of a file in memory all of it is read
 * before, without decoding layers. Of a file that is fed, what says how the picture is shown has arrived
 * with the first layer, and the rest with the end. On failure for what the file is, it is filled with what
 * stands before the error.
 *
 * All that it points to is valid until gip_decoder_feed, gip_decoder_metadata or gip_decoder_free are called
 * with the decoder. It may be used as it is for gip_source.metadata.
 */
gip_status gip_decoder_metadata(struct gip_decoder *decoder,
                                struct gip_metadata *metadata);

/**
 * Fills `output`, whose struct_size is set, with the size of what gip_render writes for this view. It is
 * checked against the limits, so that it is safe to allocate. `view` may be null for the whole picture as
 * it is stored.
 *
 * Fails with GIP_STATUS_NEED_MORE if the header has not arrived, GIP_STATUS_ARGUMENT for a view that is out
 * of range or does not suit the picture, and GIP_STATUS_LIMIT if it exceeds a limit.
 */
gip_status gip_output_size(const struct gip_decoder *decoder,
                           const struct gip_view *view,
                           struct gip_output *output);

/**
 * Renders a view of the picture to `out`: the rows of gip_output_size, each `stride` bytes after the one
 * before; 0 stands for rows without padding. Bytes between rows are left alone.
 *
 * `view` may be null for the whole picture as it is stored. `out` has `size` bytes, and is aligned for its
 * samples, as `stride` is. It must not overlap the file. Rows with padding, GIP_SAMPLES_F32 and what is
 * composed take memory for a copy of the output beside, which gip_limits.max_memory does not count.
 *
 * Of a file in memory, what the view needs is read and decoded, and a damaged file fails. Of a file that is
 * fed, the Gaussians that have arrived are rendered, after a failure as well; before the header has arrived
 * it fails with GIP_STATUS_NEED_MORE. GIP_STATUS_ARGUMENT and GIP_STATUS_LIMIT are as of gip_output_size;
 * memory and work may exceed a limit as well. What `out` has after a failure is not specified.
 */
gip_status gip_render(struct gip_decoder *decoder,
                      const struct gip_view *view,
                      void *out,
                      size_t stride,
                      size_t size);

/**
 * Encodes a picture. This is an optimization, and takes seconds.
 *
 * `options` may be null for the defaults. `*file` is set to the file, to be freed with gip_buffer_free, or
 * to an empty buffer on failure; what it was before is not freed. `report` may be null; else its struct_size
 * is set, and it is filled. A target that cannot be met is no failure: gip_report.shortfall says why.
 *
 * Fails with GIP_STATUS_ARGUMENT for a source or options that are out of range, and for a size that only
 * the metadata keep out of reach; GIP_STATUS_LIMIT if a decoder with these limits would refuse the file;
 * GIP_STATUS_CANCELLED, _MEMORY and _THREADS.
 */
gip_status gip_encode(const struct gip_source *source,
                      const struct gip_encode_options *options,
                      struct gip_buffer *file,
                      struct gip_report *report);

/**
 * Makes a small file of the first layers of another one: of as many as fit `most` bytes. It keeps what says
 * how the picture is shown, its colours and its orientation; texture and other metadata are left out.
 * Nothing is decoded.
 *
 * `data` is a file of `size` bytes, or the beginning of one. `*prefix` is set to the small file, to be freed
 * with gip_buffer_free, or to an empty buffer on failure: GIP_STATUS_ARGUMENT if the file of the first
 * layer has more than `most` bytes, GIP_STATUS_NEED_MORE if no layer is complete, and else what
 * gip_decoder_feed says of a damaged file.
 */
gip_status gip_prefix(const void *data,
                      size_t size,
                      size_t most,
                      struct gip_buffer *prefix);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

/**
 * Defines gip_view_default() and so on: a structure whose struct_size is set and whose other fields are 0,
 * for a function to read, or to fill.
 */
#define GIP_DEFAULT_OF(type) \
    static inline type type##_default(void) \
    { \
        type made; \
        memset(&made, 0, sizeof made); \
        made.struct_size = sizeof made; \
        return made; \
    }

GIP_DEFAULT_OF(gip_encode_options)
GIP_DEFAULT_OF(gip_info)
GIP_DEFAULT_OF(gip_limits)
GIP_DEFAULT_OF(gip_metadata)
GIP_DEFAULT_OF(gip_output)
GIP_DEFAULT_OF(gip_report)
GIP_DEFAULT_OF(gip_source)
GIP_DEFAULT_OF(gip_view)

#undef GIP_DEFAULT_OF

#endif /* GIP_H */

// SPDX-License-Identifier: MIT OR Apache-2.0
#include "handler.h"

#include "color.h"

#include <QColorSpace>
#include <QIODevice>
#include <QImage>
#include <QLoggingCategory>
#include <QThread>
#include <cmath>
#include <list>
#include <vector>

namespace {

Q_LOGGING_CATEGORY(lcGip, "image_gip")

// The signature, and the longest header with its type, length and checksum.
constexpr int headerSize = 8 + 1 + 2 + 255 + 4;
// The sides of what file managers call a large thumbnail. Up to here, and with a quality below 50 at any
// size, a preview is what is wanted: the strongest Gaussians, for a part of the time.
constexpr quint32 previewSide = 256;
constexpr int previewQuality = 50;
// An effort of gip_encode_options, for QImageWriter::setOptimizedWrite: four times the time of the default.
constexpr quint32 optimizedEffort = 6;
// The largest output that a view may have, and a bit more, which the library refuses.
constexpr double tooLarge = (1 << 23) + 1;
// The name of an XMP packet among the texts of a QImage, as Qt's reader of PNG has it.
const char xmpKey[] = "XML:com.adobe.xmp";

bool failed(const char *what)
{
    qCWarning(lcGip, "%s: %s", what, gip_last_error());
    return false;
}

quint32 threads()
{
    return quint32(qBound(1, QThread::idealThreadCount(), 64));
}

QImage::Format formatOf(const gip_info &info)
{
    const bool wide = info.depth == 16;
    switch (info.color) {
    case GIP_COLOR_GRAY:
        return wide ? QImage::Format_Grayscale16 : QImage::Format_Grayscale8;
    case GIP_COLOR_RGB:
        return wide ? QImage::Format_RGBX64 : QImage::Format_RGBX8888;
    default:
        return wide ? QImage::Format_RGBA64 : QImage::Format_RGBA8888;
    }
}

// Qt mirrors first, and then turns to the right.
QImageIOHandler::Transformation transformationOf(quint32 orientation)
{
    switch (orientation) {
    case 2:
        return QImageIOHandler::TransformationMirror;
    case 3:
        return QImageIOHandler::TransformationRotate180;
    case 4:
        return QImageIOHandler::TransformationFlip;
    case 5:
        return QImageIOHandler::TransformationFlipAndRotate90;
    case 6:
        return QImageIOHandler::TransformationRotate90;
    case 7:
        return QImageIOHandler::TransformationMirrorAndRotate90;
    case 8:
        return QImageIOHandler::TransformationRotate270;
    default:
        return QImageIOHandler::TransformationNone;
    }
}

// The texts of a picture in the one string that QImageReader::text() takes apart again.
QString descriptionOf(const gip_metadata &metadata)
{
    QStringList parts;
    for (size_t i = 0; i < metadata.text_count; ++i) {
        const gip_text &text = metadata.texts[i];
        parts += QString::fromUtf8(text.keyword) + QLatin1String(": ") + QString::fromUtf8(text.text).simplified();
    }
    return parts.join(QLatin1String("\n\n"));
}

// Metadata for the encoder, and the memory that they point to.
class Metadata
{
public:
    gip_metadata metadata = gip_metadata_default();

    // `description` is what QImageWriter::setText() has collected.
    Metadata(const QImage &image, const QString &description)
    {
        const QStringList keys = image.textKeys();
        for (const QString &key : keys)
            add(key, image.text(key));
        const QStringList parts = description.split(QLatin1String("\n\n"));
        for (const QString &part : parts) {
            const int colon = int(part.indexOf(QLatin1Char(':')));
            if (colon > 0)
                add(part.left(colon), part.mid(colon + 1).trimmed());
        }
        metadata.texts = m_texts.data();
        metadata.text_count = m_texts.size();
        addColorSpace(image.colorSpace());
    }

private:
    Q_DISABLE_COPY(Metadata)

    const QByteArray &kept(QByteArray bytes) { return m_kept.emplace_back(std::move(bytes)); }

    static gip_blob blob(const QByteArray &bytes)
    {
        return {reinterpret_cast<const uint8_t *>(bytes.constData()), size_t(bytes.size())};
    }

    void add(const QString &key, const QString &text)
    {
        const QByteArray &keyword = kept(key.toUtf8());
        if (keyword == xmpKey)
            metadata.xmp = blob(kept(text.toUtf8()));
        else if (keyword.isEmpty() || keyword.size() > 79)
            qCWarning(lcGip, "a text is left out, as its key is not of 1 to 79 bytes");
        else
            m_texts.push_back({keyword.constData(), kept(text.toUtf8()).constData()});
    }

    void addColorSpace(const QColorSpace &space)
    {
        if (!space.isValid() || space == QColorSpace(QColorSpace::SRgb))
            return;
        if (const auto codes = codesOf(space)) {
            metadata.cicp = *codes;
            metadata.present |= GIP_METADATA_CICP;
        } else {
            metadata.icc = blob(kept(space.iccProfile()));
        }
    }

    std::list<QByteArray> m_kept;
    std::vector<gip_text> m_texts;
};

} // namespace

bool GipHandler::canRead(QIODevice *device)
{
    const QByteArray start = device->peek(8);
    return gip_is_gip(start.constData(), size_t(start.size())) != 0;
}

bool GipHandler::canRead() const
{
    if (m_decoder ? m_read : !device() || !canRead(device()))
        return false;
    setFormat("gip");
    return true;
}

// A decoder that shows what there is of a file, in whatever condition that is.
GipHandler::Decoder GipHandler::fed(const QByteArray &file, const gip_limits *limits)
{
    gip_decoder *decoder = nullptr;
    if (gip_decoder_new(limits, &decoder) == GIP_STATUS_OK)
        gip_decoder_feed(decoder, file.constData(), size_t(file.size()), nullptr);
    return Decoder(decoder);
}

// Reads the file, if that has not been done. Whether there is something to show of it.
bool GipHandler::load() const
{
    if (m_decoder)
        return m_loaded;
    if (!device() || !device()->isReadable())
        return false;
    m_file = device()->readAll();
    gip_decoder *decoder = nullptr;
    if (gip_decoder_open(m_file.constData(), size_t(m_file.size()), nullptr, &decoder) == GIP_STATUS_OK) {
        m_decoder.reset(decoder);
        return m_loaded = true;
    }
    return loadArrived();
}

// Makes do with what precedes the damage of a file, which the library has just found.
bool GipHandler::loadArrived() const
{
    failed("the file is damaged");
    m_decoder = fed(m_file, nullptr);
    gip_info info = gip_info_default();
    return m_loaded = gip_decoder_info(m_decoder.get(), &info) == GIP_STATUS_OK && info.decoded_gaussians > 0;
}

// Takes nothing from the device.
bool GipHandler::header(gip_info *info) const
{
    *info = gip_info_default();
    if (m_decoder)
        return gip_decoder_info(m_decoder.get(), info) == GIP_STATUS_OK;
    if (!device() || !device()->isReadable())
        return false;
    // Also pictures that are too large to be shown have a size.
    gip_limits limits = gip_limits_default();
    limits.max_width = limits.max_height = limits.max_gaussians = UINT32_MAX;
    limits.max_pixels = UINT64_MAX;
    const Decoder decoder = fed(device()->peek(headerSize), &limits);
    return gip_decoder_info(decoder.get(), info) == GIP_STATUS_OK;
}

// Sets `view` to what the options say: first a part of the picture, then its size, then a part of that.
bool GipHandler::view(const gip_info &info, gip_view *view) const
{
    const QRect whole(0, 0, int(info.width), int(info.height));
    const QRect clip = m_options.value(ClipRect).toRect();
    const QRect part = clip.isNull() ? whole : clip & whole;
    if (part.isEmpty())
        return false;
    const QSize asked = m_options.value(ScaledSize).toSize();
    const QSize size = asked.isEmpty() ? part.size() : asked;

    // The library takes a part of the scaled picture, so edges between two pixels of it move by half a pixel at most.
    const double scaleX = double(size.width()) / part.width();
    const double scaleY = double(size.height()) / part.height();
    const auto scaled = [](double length) { return int(std::fmin(std::fmax(std::round(length), 1.0), tooLarge)); };
    const QSize output(scaled(whole.width() * scaleX), scaled(whole.height() * scaleY));
    QRect region(QPoint(int(std::fmin(std::round(part.x() * scaleX), tooLarge)),
                        int(std::fmin(std::round(part.y() * scaleY), tooLarge))),
                 size);
    region.moveLeft(qMax(0, qMin(region.x(), output.width() - size.width())));
    region.moveTop(qMax(0, qMin(region.y(), output.height() - size.height())));
    const QRect scaledClip = m_options.value(ScaledClipRect).toRect();
    if (!scaledClip.isNull())
        region = (scaledClip & QRect(QPoint(), size)).translated(region.topLeft());
    if (region.isEmpty())
        return false;

    *view = gip_view_default();
    view->width = quint32(output.width());
    view->height = quint32(output.height());
    view->region_x = quint32(region.x());
    view->region_y = quint32(region.y());
    view->region_width = quint32(region.width());
    view->region_height = quint32(region.height());
    // Qt has no format of gray and alpha, and none of three times 16 bits.
    view->color = info.color == GIP_COLOR_GRAY ? GIP_COLOR_GRAY : GIP_COLOR_RGBA;
    view->threads = threads();
    const int quality = m_options.value(Quality, -1).toInt();
    const bool small = output != whole.size() && view->width <= previewSide && view->height <= previewSide;
    if (quality < 0 ? small : quality < previewQuality)
        gip_decoder_gaussians_for(m_decoder.get(), view->width, view->height, &view->gaussians);
    return true;
}

bool GipHandler::render(const gip_info &info, const gip_view &view, QImage *image) const
{
    gip_output output = gip_output_default();
    if (gip_output_size(m_decoder.get(), &view, &output) != GIP_STATUS_OK)
        return failed("the picture is not shown");
    const QSize size(int(output.width), int(output.height));
#if QT_VERSION >= QT_VERSION_CHECK(6, 0, 0)
    if (!allocateImage(size, formatOf(info), image))
        return false;
#else
    *image = QImage(size, formatOf(info));
    if (image->isNull())
        return false;
#endif
    const auto rendered = [&] {
        return gip_render(m_decoder.get(), &view, image->bits(), size_t(image->bytesPerLine()),
                          size_t(image->sizeInBytes()));
    };
    gip_status status = rendered();
    if (status == GIP_STATUS_MALFORMED || status == GIP_STATUS_UNSUPPORTED || status == GIP_STATUS_UNEXPECTED_END) {
        if (!loadArrived())
            return false;
        status = rendered();
    }
    return status == GIP_STATUS_OK || failed("the picture is not shown");
}

bool GipHandler::read(QImage *image)
{
    gip_info info;
    gip_view view;
    if (m_read || !load() || !header(&info))
        return false;
    m_read = true;
    QImage picture;
    if (!this->view(info, &view) || !render(info, view, &picture))
        return false;

    gip_metadata metadata = gip_metadata_default();
    // What precedes damage, which was told, is there all the same.
    gip_decoder_metadata(m_decoder.get(), &metadata);
    picture.setColorSpace(colorSpaceOf(metadata, info.color));
    for (size_t i = 0; i < metadata.text_count; ++i)
        picture.setText(QString::fromUtf8(metadata.texts[i].keyword), QString::fromUtf8(metadata.texts[i].text));
    if (metadata.xmp.size > 0) {
        picture.setText(QLatin1String(xmpKey),
                        QString::fromUtf8(reinterpret_cast<const char *>(metadata.xmp.data), int(metadata.xmp.size)));
    }
    *image = picture;
    return true;
}

bool GipHandler::write(const QImage &image)
{
    const auto turn = Transformations(m_options.value(ImageTransformation).toInt());
    QImage picture = image.mirrored(turn & TransformationMirror, turn & TransformationFlip);
    if (turn & TransformationRotate90)
        picture = picture.transformed(QTransform().rotate(90));

    const QPixelFormat pixel = picture.pixelFormat();
    const bool wide = pixel.redSize() > 8;
    const bool gray = pixel.colorModel() == QPixelFormat::Grayscale
        || (pixel.colorModel() == QPixelFormat::Indexed && picture.isGrayscale() && !picture.hasAlphaChannel());
    gip_source source = gip_source_default();
    source.samples = wide ? GIP_SAMPLES_U16 : GIP_SAMPLES_U8;
    if (gray) {
        source.color = GIP_COLOR_GRAY;
        picture.convertTo(wide ? QImage::Format_Grayscale16 : QImage::Format_Grayscale8);
    } else if (picture.hasAlphaChannel()) {
        source.color = GIP_COLOR_RGBA;
        picture.convertTo(wide ? QImage::Format_RGBA64 : QImage::Format_RGBA8888);
    } else {
        source.color = GIP_COLOR_RGB;
        picture.convertTo(wide ? QImage::Format_RGBX64 : QImage::Format_RGB888);
    }
    if (picture.isNull())
        return false;
    source.width = quint32(picture.width());
    source.height = quint32(picture.height());
    source.pixels = picture.constBits();
    source.stride = size_t(picture.bytesPerLine());
    source.size = size_t(picture.sizeInBytes());
    std::vector<quint16> packed;
    if (wide && source.color == GIP_COLOR_RGB) {
        packed.reserve(size_t(picture.width()) * size_t(picture.height()) * 3);
        for (int y = 0; y < picture.height(); ++y) {
            const auto *row = reinterpret_cast<const quint16 *>(picture.constScanLine(y));
            for (int x = 0; x < picture.width(); ++x)
                packed.insert(packed.end(), row + 4 * x, row + 4 * x + 3);
        }
        source.pixels = packed.data();
        source.stride = 0;
        source.size = packed.size() * sizeof(quint16);
    }
    const Metadata metadata(picture, m_options.value(Description).toString());
    source.metadata = &metadata.metadata;

    gip_encode_options options = gip_encode_options_default();
    const int quality = m_options.value(Quality, -1).toInt();
    if (quality >= 0) {
        options.target = GIP_TARGET_QUALITY;
        options.value = qMin(quality, 100);
    }
    if (m_options.value(OptimizedWrite).toBool())
        options.effort = optimizedEffort;
    options.threads = threads();
    gip_buffer file;
    if (gip_encode(&source, &options, &file, nullptr) != GIP_STATUS_OK)
        return failed("the picture is not encoded");
    const qint64 size = qint64(file.size);
    const bool written = device()->write(reinterpret_cast<const char *>(file.data), size) == size;
    gip_buffer_free(&file);
    return written;
}

QVariant GipHandler::option(ImageOption option) const
{
    gip_info info;
    switch (option) {
    case Size:
        return header(&info) ? QVariant(QSize(int(info.width), int(info.height))) : QVariant();
    case ImageFormat:
        return header(&info) ? QVariant(int(formatOf(info))) : QVariant();
    case ImageTransformation:
        if (load() && header(&info))
            return int(transformationOf(info.orientation));
        break;
    case Description:
        if (load()) {
            gip_metadata metadata = gip_metadata_default();
            gip_decoder_metadata(m_decoder.get(), &metadata);
            return descriptionOf(metadata);
        }
        break;
    default:
        break;
    }
    return m_options.value(option);
}

void GipHandler::setOption(ImageOption option, const QVariant &value)
{
    m_options.insert(option, value);
}

bool GipHandler::supportsOption(ImageOption option) const
{
    switch (option) {
    case Size:
    case ImageFormat:
    case ImageTransformation:
    case Description:
    case ClipRect:
    case ScaledSize:
    case ScaledClipRect:
    case Quality:
    case OptimizedWrite:
        return true;
    default:
        return false;
    }
}

// SPDX-License-Identifier: MIT OR Apache-2.0
// Reads and writes files with QImageReader and QImageWriter, as programs do. VECTORS is the folder spec/vectors.
#include <QBuffer>
#include <QColorSpace>
#include <QDir>
#include <QImageReader>
#include <QImageWriter>
#include <QtTest>
#include <functional>
#include <gip.h>

namespace {

QString vectorPath(const QString &name)
{
    return QDir(qEnvironmentVariable("VECTORS")).filePath(name);
}

QByteArray vectorBytes(const QString &name)
{
    QFile file(vectorPath(name));
    if (!file.open(QIODevice::ReadOnly))
        qFatal("there is no %s", qPrintable(file.fileName()));
    return file.readAll();
}

// A picture with another colour in each corner, upright.
QImage corners(int width = 96, int height = 64)
{
    QImage image(width, height, QImage::Format_RGB32);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const bool right = x >= width / 2;
            const bool low = y >= height / 2;
            image.setPixel(x, y, right ? (low ? qRgb(230, 230, 60) : qRgb(40, 200, 60))
                                       : (low ? qRgb(50, 60, 220) : qRgb(220, 40, 50)));
        }
    }
    return image;
}

// One with detail everywhere, which takes many Gaussians.
QImage busy()
{
    QImage image(160, 120, QImage::Format_RGB32);
    for (int y = 0; y < image.height(); ++y) {
        for (int x = 0; x < image.width(); ++x)
            image.setPixel(x, y, qRgb((x * x / 30 + y) % 200, (x + y * y / 40) % 220, (x ^ y) % 160));
    }
    return image;
}

QByteArray written(const QImage &image, const std::function<void(QImageWriter &)> &set = {})
{
    QBuffer buffer;
    buffer.open(QIODevice::WriteOnly);
    QImageWriter writer(&buffer, "gip");
    if (set)
        set(writer);
    return writer.write(image) ? buffer.data() : QByteArray();
}

QImage readBack(const QByteArray &file, const std::function<void(QImageReader &)> &set = {})
{
    QBuffer buffer;
    buffer.setData(file);
    buffer.open(QIODevice::ReadOnly);
    QImageReader reader(&buffer);
    if (set)
        set(reader);
    return reader.read();
}

// A file of `image` with metadata that QImageWriter does not write.
QByteArray encoded(const QImage &image, const std::function<void(gip_metadata &)> &set)
{
    const QImage rgb = image.convertToFormat(QImage::Format_RGB888);
    gip_metadata metadata = gip_metadata_default();
    set(metadata);
    gip_source source = gip_source_default();
    source.width = quint32(rgb.width());
    source.height = quint32(rgb.height());
    source.color = GIP_COLOR_RGB;
    source.samples = GIP_SAMPLES_U8;
    source.pixels = rgb.constBits();
    source.stride = size_t(rgb.bytesPerLine());
    source.size = size_t(rgb.sizeInBytes());
    source.metadata = &metadata;
    gip_encode_options options = gip_encode_options_default();
    options.effort = 1;
    gip_buffer buffer;
    if (gip_encode(&source, &options, &buffer, nullptr) != GIP_STATUS_OK)
        qFatal("%s", gip_last_error());
    const QByteArray file(reinterpret_cast<const char *>(buffer.data), int(buffer.size));
    gip_buffer_free(&buffer);
    return file;
}

gip_blob blob(const QByteArray &bytes)
{
    return {reinterpret_cast<const uint8_t *>(bytes.constData()), size_t(bytes.size())};
}

// What the library renders of a file, as an image.
QImage rendered(const QByteArray &file, gip_view view, QImage::Format format)
{
    gip_decoder *decoder = nullptr;
    gip_output output = gip_output_default();
    if (gip_decoder_open(file.constData(), size_t(file.size()), nullptr, &decoder) != GIP_STATUS_OK
        || gip_output_size(decoder, &view, &output) != GIP_STATUS_OK)
        qFatal("%s", gip_last_error());
    QImage image(int(output.width), int(output.height), format);
    if (gip_render(decoder, &view, image.bits(), size_t(image.bytesPerLine()), size_t(image.sizeInBytes()))
        != GIP_STATUS_OK)
        qFatal("%s", gip_last_error());
    gip_decoder_free(decoder);
    image.setColorSpace(QColorSpace::SRgb);
    return image;
}

double difference(const QImage &a, const QImage &b)
{
    if (a.size() != b.size())
        return 1e9;
    double sum = 0;
    for (int y = 0; y < a.height(); ++y) {
        for (int x = 0; x < a.width(); ++x) {
            const QColor p = a.pixelColor(x, y);
            const QColor q = b.pixelColor(x, y);
            sum += std::abs(p.red() - q.red()) + std::abs(p.green() - q.green()) + std::abs(p.blue() - q.blue())
                + std::abs(p.alpha() - q.alpha());
        }
    }
    return sum / 4 / a.width() / a.height();
}

// A device that cannot go back.
class Pipe : public QIODevice
{
public:
    explicit Pipe(const QByteArray &bytes) : m_rest(bytes) {}
    bool isSequential() const override { return true; }

protected:
    qint64 readData(char *data, qint64 size) override
    {
        const int count = int(qMin(size, qint64(m_rest.size())));
        memcpy(data, m_rest.constData(), size_t(count));
        m_rest.remove(0, count);
        return count;
    }
    qint64 writeData(const char *, qint64) override { return -1; }

private:
    QByteArray m_rest;
};

// A file of one colour and so many pixels.
QByteArray blank(quint32 width, quint32 height)
{
    const auto number = [](quint32 value) {
        QByteArray bytes;
        for (; value > 127; value /= 128)
            bytes += char(value % 128 + 128);
        return bytes + char(value);
    };
    const auto chunk = [&](char type, const QByteArray &payload) {
        QByteArray bytes = type + number(quint32(payload.size())) + payload;
        quint32 crc = 0xffffffff;
        for (const char byte : bytes) {
            crc ^= quint8(byte);
            for (int bit = 0; bit < 8; ++bit)
                crc = crc & 1 ? crc >> 1 ^ 0xedb88320 : crc >> 1;
        }
        for (int byte = 0; byte < 4; ++byte)
            bytes += char(~crc >> 8 * byte);
        return bytes;
    };
    return "\xc7GIP\r\n\x01\n" + chunk('H', "\x1a" + number(width) + number(height) + QByteArray(1, '\0') + "abc")
        + chunk('E', {});
}

const QRegularExpression anyDamage(QStringLiteral("^(the file is damaged|the picture is not shown): "));

} // namespace

class PluginTest : public QObject
{
    Q_OBJECT

private slots:
    void isListed()
    {
        QVERIFY(QImageReader::supportedImageFormats().contains("gip"));
        QVERIFY(QImageWriter::supportedImageFormats().contains("gip"));
        QVERIFY(QImageReader::supportedMimeTypes().contains("image/vnd.gip"));
        QCOMPARE(QImageReader::imageFormatsForMimeType("image/vnd.gip"), QList<QByteArray>{"gip"});
    }

    void isFoundByContent()
    {
        QCOMPARE(QImageReader::imageFormat(vectorPath("rgb8.gip")), QByteArray("gip"));
        QBuffer buffer;
        buffer.setData(vectorBytes("rgb8.gip"));
        buffer.open(QIODevice::ReadOnly);
        QImageReader reader(&buffer);
        QVERIFY(reader.canRead());
        QCOMPARE(reader.format(), QByteArray("gip"));
        QVERIFY(!reader.read().isNull());
        QVERIFY(!reader.canRead());
        QVERIFY(reader.read().isNull());
        QVERIFY(readBack(vectorBytes("rgb8.gip").mid(1)).isNull());
        QVERIFY(readBack("\x89PNG\r\n\x1a\n", [](QImageReader &r) { r.setFormat("gip"); }).isNull());
        QVERIFY(readBack({}, [](QImageReader &r) { r.setFormat("gip"); }).isNull());
    }

    void sizeTakesTheHeader()
    {
        const QByteArray file = written(corners());
        QBuffer buffer;
        buffer.setData(file.left(120) + "what is not looked at");
        buffer.open(QIODevice::ReadOnly);
        QImageReader reader(&buffer);
        QCOMPARE(reader.size(), QSize(96, 64));
        QCOMPARE(reader.imageFormat(), QImage::Format_RGBX8888);
        QCOMPARE(buffer.pos(), 0);
        // A picture that no limit allows has a size all the same.
        QBuffer huge;
        huge.setData(blank(1 << 20, 1 << 20));
        huge.open(QIODevice::ReadOnly);
        QCOMPARE(QImageReader(&huge).size(), QSize(1 << 20, 1 << 20));
    }

    void formats_data()
    {
        QTest::addColumn<QString>("name");
        QTest::addColumn<QImage::Format>("format");
        QTest::newRow("gray8") << "entropy-gray8.gip" << QImage::Format_Grayscale8;
        QTest::newRow("gray16") << "entropy-gray16.gip" << QImage::Format_Grayscale16;
        QTest::newRow("gray-alpha8") << "entropy-gray-alpha8.gip" << QImage::Format_RGBA8888;
        QTest::newRow("gray-alpha16") << "entropy-gray-alpha16.gip" << QImage::Format_RGBA64;
        QTest::newRow("rgb8") << "entropy-rgb8.gip" << QImage::Format_RGBX8888;
        QTest::newRow("rgb16") << "entropy-rgb16.gip" << QImage::Format_RGBX64;
        QTest::newRow("rgba8") << "entropy-rgba8.gip" << QImage::Format_RGBA8888;
        QTest::newRow("rgba16") << "entropy-rgba16.gip" << QImage::Format_RGBA64;
        QTest::newRow("packed") << "gray16.gip" << QImage::Format_Grayscale16;
        QTest::newRow("no Gaussians") << "no-gaussians.gip" << QImage::Format_RGBA8888;
    }

    void formats()
    {
        QFETCH(QString, name);
        QFETCH(QImage::Format, format);
        QImageReader reader(vectorPath(name));
        QCOMPARE(reader.imageFormat(), format);
        const QImage image = reader.read();
        QCOMPARE(image.format(), format);
        gip_view view = gip_view_default();
        const bool gray = format == QImage::Format_Grayscale8 || format == QImage::Format_Grayscale16;
        view.color = gray ? GIP_COLOR_GRAY : GIP_COLOR_RGBA;
        QCOMPARE(image, rendered(vectorBytes(name), view, format));
    }

    void scaled()
    {
        const QByteArray file = written(corners(600, 400));
        gip_view view = gip_view_default();
        view.color = GIP_COLOR_RGBA;
        view.width = 300;
        view.height = 500;
        const auto size = [](QImageReader &reader) { reader.setScaledSize({300, 500}); };
        QCOMPARE(readBack(file, size), rendered(file, view, QImage::Format_RGBX8888));

        // Of an upright picture, sizes are those of the stored one.
        view.width = view.height = 0;
        const QImage whole = rendered(file, view, QImage::Format_RGBX8888);
        const QRect part(31, 17, 200, 100);
        QCOMPARE(readBack(file, [=](QImageReader &reader) { reader.setClipRect(part); }), whole.copy(part));
        // What is outside of the picture is not there.
        QCOMPARE(readBack(file, [=](QImageReader &reader) { reader.setClipRect({500, 300, 4000, 4000}); }),
                 whole.copy(500, 300, 100, 100));
        QVERIFY(readBack(file, [=](QImageReader &reader) { reader.setClipRect({600, 0, 9, 9}); }).isNull());

        // A part of the scaled picture, a scaled part, and a part of that.
        view.width = 1200;
        view.height = 800;
        const QImage twice = rendered(file, view, QImage::Format_RGBX8888);
        QCOMPARE(readBack(file, [=](QImageReader &reader) {
            reader.setScaledSize({1200, 800});
            reader.setScaledClipRect(part);
        }), twice.copy(part));
        const auto scaledPart = [=](QImageReader &reader) {
            reader.setClipRect(part);
            reader.setScaledSize(part.size() * 2);
        };
        const QImage partTwice = twice.copy(QRect(part.topLeft() * 2, part.size() * 2));
        QCOMPARE(readBack(file, scaledPart), partTwice);
        QCOMPARE(readBack(file, [=](QImageReader &reader) {
            scaledPart(reader);
            reader.setScaledClipRect({5, 6, 70, 8000});
        }), partTwice.copy(5, 6, 70, 194));
        // Where the scale is no whole number, it is right but for a pixel.
        const QImage odd = readBack(file, [=](QImageReader &reader) {
            reader.setClipRect(part);
            reader.setScaledSize({333, 71});
        });
        QVERIFY(difference(odd, whole.copy(part).scaled(333, 71, Qt::IgnoreAspectRatio, Qt::SmoothTransformation)) < 2);
    }

    void previews()
    {
        // So many Gaussians that a sixth of them suffices for a thumbnail.
        const QByteArray file = vectorBytes("entropy-many.gip");
        gip_decoder *decoder = nullptr;
        QCOMPARE(gip_decoder_open(file.constData(), size_t(file.size()), nullptr, &decoder), GIP_STATUS_OK);
        gip_view view = gip_view_default();
        view.color = GIP_COLOR_RGBA;
        view.width = view.height = 16;
        quint32 few = 0;
        QCOMPARE(gip_decoder_gaussians_for(decoder, 16, 16, &few), GIP_STATUS_OK);
        gip_info info = gip_info_default();
        QCOMPARE(gip_decoder_info(decoder, &info), GIP_STATUS_OK);
        gip_decoder_free(decoder);
        QVERIFY(few > 0 && few < info.gaussians);
        QVERIFY(info.color == GIP_COLOR_RGB || info.color == GIP_COLOR_GRAY);
        view.color = info.color == GIP_COLOR_GRAY ? GIP_COLOR_GRAY : GIP_COLOR_RGBA;
        const QImage::Format format = QImageReader(vectorPath("entropy-many.gip")).imageFormat();
        const QImage all = rendered(file, view, format);
        view.gaussians = few;
        const QImage preview = rendered(file, view, format);
        QVERIFY(preview != all);
        const auto read = [&](int quality) {
            return readBack(file, [=](QImageReader &reader) {
                reader.setScaledSize({16, 16});
                reader.setQuality(quality);
            });
        };
        QCOMPARE(read(-1), preview);
        QCOMPARE(read(0), preview);
        QCOMPARE(read(50), all);
    }

    void orientations()
    {
        const QImage upright = corners();
        for (char orientation = 1; orientation <= 8; ++orientation) {
            QByteArray exif("II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0?\0\0\0\0\0\0\0", 26);
            exif[18] = orientation;
            // The stored picture that is upright when it is turned so.
            const QByteArray probe = encoded(corners(), [&](gip_metadata &metadata) { metadata.exif = blob(exif); });
            QBuffer buffer;
            buffer.setData(probe);
            buffer.open(QIODevice::ReadOnly);
            QImageReader reader(&buffer);
            reader.setAutoTransform(true);
            const QImageIOHandler::Transformations turn = reader.transformation();
            const QImage turned = reader.read();
            const QImage stored = readBack(probe);
            QCOMPARE(stored.size(), upright.size());
            QCOMPARE(turned.size(), orientation < 5 ? upright.size() : upright.size().transposed());
            // Where Exif says that the first pixel of the first row is to be.
            const int places[][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}, {1, 0}, {1, 1}, {0, 1}};
            const auto *place = places[orientation - 1];
            const int x = place[0] ? turned.width() - 9 : 8;
            const int y = place[1] ? turned.height() - 9 : 8;
            QVERIFY2(qRed(turned.pixel(x, y)) > 180 && qGreen(turned.pixel(x, y)) < 90, qPrintable(QString::number(orientation)));
            // Where the last pixel of the first row is to be, which is green.
            const bool swapped = orientation >= 5;
            const int u = swapped ? x : turned.width() - 1 - x;
            const int v = swapped ? turned.height() - 1 - y : y;
            QVERIFY2(qGreen(turned.pixel(u, v)) > 150 && qRed(turned.pixel(u, v)) < 100, qPrintable(QString::number(orientation)));
            // A picture that is to be written so is stored upright.
            const QByteArray again = written(corners(), [=](QImageWriter &writer) { writer.setTransformation(turn); });
            QBuffer upwards;
            upwards.setData(again);
            upwards.open(QIODevice::ReadOnly);
            QImageReader check(&upwards);
            QCOMPARE(check.transformation(), QImageIOHandler::TransformationNone);
            QVERIFY(difference(check.read(), turned) < 4);
        }
    }

    void colorSpaces()
    {
        QCOMPARE(readBack(written(corners())).colorSpace(), QColorSpace(QColorSpace::SRgb));
        const QByteArray plain = written(corners());
        const QList<QColorSpace> spaces{
            QColorSpace::SRgb, QColorSpace::SRgbLinear, QColorSpace::DisplayP3, QColorSpace::AdobeRgb,
            QColorSpace::ProPhotoRgb, QColorSpace(QColorSpace::Primaries::DciP3D65, 2.2F)};
        for (const QColorSpace &space : spaces) {
            QImage image = corners();
            image.setColorSpace(space);
            const QByteArray file = written(image);
            QCOMPARE(readBack(file).colorSpace(), space);
            // Codes where there are some.
            QCOMPARE(file.contains("iCCP"), space == QColorSpace::AdobeRgb || space == QColorSpace::ProPhotoRgb);
            QCOMPARE(file.contains("cICP"), space != QColorSpace::SRgb && !file.contains("iCCP"));
        }
        const auto coded = [](quint8 primaries, quint8 transfer, const QByteArray &profile = {}) {
            return readBack(encoded(corners(), [&](gip_metadata &metadata) {
                metadata.present = GIP_METADATA_CICP;
                metadata.cicp = {primaries, transfer};
                metadata.icc = blob(profile);
            })).colorSpace();
        };
        QCOMPARE(coded(9, 13).transferFunction(), QColorSpace::TransferFunction::SRgb);
        QVERIFY(coded(9, 13) != QColorSpace(QColorSpace::SRgb));
        // Codes count before a profile, unless they are not known.
        const QByteArray profile = QColorSpace(QColorSpace::AdobeRgb).iccProfile();
        QCOMPARE(coded(12, 13, profile), QColorSpace(QColorSpace::DisplayP3));
        QCOMPARE(coded(12, 200, profile), QColorSpace(QColorSpace::AdobeRgb));
        QCOMPARE(coded(200, 13), QColorSpace(QColorSpace::SRgb));
        // A profile that is none, and one for gray.
        QByteArray gray = profile;
        gray.replace(16, 4, "GRAY");
        for (const QByteArray &bytes : {QByteArray("no profile"), gray}) {
            const QByteArray file = encoded(corners(), [&](gip_metadata &metadata) { metadata.icc = blob(bytes); });
            QVERIFY(file.contains("iCCP"));
            QCOMPARE(readBack(file).colorSpace(), QColorSpace(QColorSpace::SRgb));
        }
    }

    void texts()
    {
        const QString xmp = "<x:xmpmeta xmlns:x=\"adobe:ns:meta/\"/>";
        QImage image = corners();
        image.setText("Title", QString::fromUtf8("Bäume\nam See"));
        image.setText("Creation Time", "yesterday");
        image.setText("XML:com.adobe.xmp", xmp);
        QTest::ignoreMessage(QtWarningMsg, "a text is left out, as its key is not of 1 to 79 bytes");
        image.setText(QString(80, 'a'), "too long");
        const QByteArray file = written(image, [](QImageWriter &writer) { writer.setText("Author", "A: B"); });
        QBuffer buffer;
        buffer.setData(file);
        buffer.open(QIODevice::ReadOnly);
        QImageReader reader(&buffer);
        QCOMPARE(reader.text("Title"), QString::fromUtf8("Bäume am See"));
        QVERIFY(reader.textKeys().contains("Author"));
        const QImage back = reader.read();
        QCOMPARE(back.textKeys().size(), 4);
        QCOMPARE(back.text("Title"), image.text("Title"));
        QCOMPARE(back.text("Creation Time"), QString("yesterday"));
        QCOMPARE(back.text("Author"), QString("A: B"));
        QCOMPARE(back.text("XML:com.adobe.xmp"), xmp);
        // As they are after reading, they can be written again.
        QCOMPARE(readBack(written(back)).text("Author"), QString("A: B"));
    }

    void qualities()
    {
        const QImage image = busy();
        const auto at = [&](int quality) {
            return written(image, [=](QImageWriter &writer) { writer.setQuality(quality); });
        };
        const QByteArray low = at(20);
        const QByteArray medium = at(75);
        const QByteArray high = at(1000);
        QVERIFY(low.size() * 3 < medium.size() * 2);
        QVERIFY(medium.size() * 3 < high.size() * 2);
        QCOMPARE(at(-1), written(image));
        QVERIFY(difference(readBack(low), image) > difference(readBack(high), image) * 2);
        const QByteArray optimized = written(image, [](QImageWriter &writer) { writer.setOptimizedWrite(true); });
        QVERIFY(!optimized.isEmpty() && optimized != written(image));
    }

    void writesAllFormats()
    {
        QImage image = corners(40, 30).convertToFormat(QImage::Format_ARGB32);
        image.setPixelColor(0, 0, QColor(220, 40, 50, 0));
        for (int format = QImage::Format_Mono; format < QImage::NImageFormats; ++format) {
            const QImage source = image.convertToFormat(QImage::Format(format));
            if (source.isNull())
                continue;
            const QByteArray file = written(source, [](QImageWriter &writer) { writer.setQuality(90); });
            const QImage back = readBack(file);
            const QImage::Format stored = back.format();
            QVERIFY2(difference(back, source) < 20, qPrintable(QString::number(format)));
            switch (format) {
            case QImage::Format_Grayscale8:
                QCOMPARE(stored, QImage::Format_Grayscale8);
                break;
            case QImage::Format_Grayscale16:
                QCOMPARE(stored, QImage::Format_Grayscale16);
                break;
            case QImage::Format_RGB32:
            case QImage::Format_RGB16:
            case QImage::Format_RGB888:
                QCOMPARE(stored, QImage::Format_RGBX8888);
                break;
            case QImage::Format_RGB30:
            case QImage::Format_RGBX64:
                QCOMPARE(stored, QImage::Format_RGBX64);
                break;
            case QImage::Format_ARGB32:
            case QImage::Format_ARGB32_Premultiplied:
                QCOMPARE(stored, QImage::Format_RGBA8888);
                break;
            case QImage::Format_RGBA64:
            case QImage::Format_A2BGR30_Premultiplied:
                QCOMPARE(stored, QImage::Format_RGBA64);
                break;
            default:
                break;
            }
        }
        QVERIFY(written(QImage()).isEmpty());
    }

    void sequentialDevices()
    {
        Pipe pipe(vectorBytes("rgb8.gip"));
        pipe.open(QIODevice::ReadOnly);
        QImageReader reader(&pipe);
        QVERIFY(reader.size().isValid());
        QVERIFY(!reader.read().isNull());
    }

    void cutFiles()
    {
        const QByteArray file = written(busy(), [](QImageWriter &writer) { writer.setQuality(90); });
        const QImage whole = readBack(file);
        int shown = 0;
        for (int size = 8; size < int(file.size()); size += qMax(1, int(file.size()) / 40)) {
            QTest::ignoreMessage(QtWarningMsg, anyDamage);
            const QImage image = readBack(file.left(size));
            if (!image.isNull()) {
                QCOMPARE(image.size(), whole.size());
                ++shown;
            }
        }
        QVERIFY2(shown > 20, qPrintable(QString::number(shown)));
        // Asking before changes nothing, and a thumbnail takes what there is.
        const QByteArray half = file.left(file.size() / 2);
        QTest::ignoreMessage(QtWarningMsg, anyDamage);
        const QImage image = readBack(half, [](QImageReader &reader) {
            QCOMPARE(reader.transformation(), QImageIOHandler::TransformationNone);
            QVERIFY(reader.textKeys().isEmpty());
        });
        QVERIFY(difference(image, whole) < 40);
        const QByteArray header = file.left(70);
        QTest::ignoreMessage(QtWarningMsg, anyDamage);
        QVERIFY(readBack(header, [](QImageReader &reader) { reader.transformation(); }).isNull());
    }

    void changedBytes()
    {
        const QByteArray file = written(corners(48, 32));
        for (int i = 8; i < int(file.size()); i += 3) {
            QByteArray changed = file;
            changed[i] = char(changed[i] ^ 0x55);
            QTest::ignoreMessage(QtWarningMsg, anyDamage);
            readBack(changed);
        }
    }

    void hostileFiles()
    {
        // All that a decoder must refuse.
        const QStringList names = QDir(qEnvironmentVariable("VECTORS")).entryList({"x*.gip"});
        QVERIFY(names.size() > 50);
        for (const QString &name : names) {
            if (!QImageReader(vectorPath(name)).canRead())
                continue;
            QTest::ignoreMessage(QtWarningMsg, anyDamage);
            QImageReader(vectorPath(name)).read();
        }
    }

    void limits()
    {
        QTest::ignoreMessage(QtWarningMsg, anyDamage);
        QVERIFY(readBack(blank(1 << 20, 1 << 20)).isNull());
        QCOMPARE(readBack(blank(300, 200)).pixel(299, 199), qRgb('a', 'b', 'c'));
        const QByteArray file = written(corners());
        for (const QSize &size : {QSize(1 << 24, 1), QSize(60000, 60000), QSize(INT_MAX, INT_MAX)}) {
            QTest::ignoreMessage(QtWarningMsg, anyDamage);
            QVERIFY(readBack(file, [=](QImageReader &reader) { reader.setScaledSize(size); }).isNull());
        }
        QTest::ignoreMessage(QtWarningMsg, anyDamage);
        QVERIFY(readBack(file, [](QImageReader &reader) {
            reader.setClipRect({95, 63, 1, 1});
            reader.setScaledSize({1 << 20, 1 << 20});
        }).isNull());
#if QT_VERSION >= QT_VERSION_CHECK(6, 0, 0)
        QImageReader::setAllocationLimit(1);
        QTest::ignoreMessage(QtWarningMsg, QRegularExpression("Rejecting image"));
        QVERIFY(readBack(file, [](QImageReader &reader) { reader.setScaledSize({2000, 2000}); }).isNull());
        QImageReader::setAllocationLimit(256);
#endif
    }
};

QTEST_GUILESS_MAIN(PluginTest)
#include "plugin_test.moc"

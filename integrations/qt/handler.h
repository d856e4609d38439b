// SPDX-License-Identifier: MIT OR Apache-2.0
#pragma once

#include <QHash>
#include <QImageIOHandler>
#include <QVariant>
#include <gip.h>
#include <memory>

// Reads or writes one picture on its device.
class GipHandler final : public QImageIOHandler
{
public:
    // Whether a .gip file begins here.
    static bool canRead(QIODevice *device);

    bool canRead() const override;
    bool read(QImage *image) override;
    bool write(const QImage &image) override;
    QVariant option(ImageOption option) const override;
    void setOption(ImageOption option, const QVariant &value) override;
    bool supportsOption(ImageOption option) const override;

private:
    struct Free
    {
        void operator()(gip_decoder *decoder) const { gip_decoder_free(decoder); }
    };
    using Decoder = std::unique_ptr<gip_decoder, Free>;

    static Decoder fed(const QByteArray &file, const gip_limits *limits);
    bool load() const;
    bool loadArrived() const;
    bool header(gip_info *info) const;
    bool view(const gip_info &info, gip_view *view) const;
    bool render(const gip_info &info, const gip_view &view, QImage *image) const;

    QHash<int, QVariant> m_options;
    bool m_read = false;
    // Qt asks for what a file says by functions that are const.
    mutable QByteArray m_file;
    mutable Decoder m_decoder;
    mutable bool m_loaded = false;
};

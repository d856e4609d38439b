// SPDX-License-Identifier: MIT OR Apache-2.0
#include "color.h"

#include <QPointF>

namespace {

constexpr quint8 primariesCodes[] = {1, 12, 9};

// The most usual of several codes with the same meaning comes first: it is the one that is written.
struct Transfer
{
    quint8 code;
    QColorSpace::TransferFunction function;
    float gamma;
};
constexpr Transfer transfers[] = {
    {13, QColorSpace::TransferFunction::SRgb, 0},
    {8, QColorSpace::TransferFunction::Linear, 0},
    {4, QColorSpace::TransferFunction::Gamma, 2.2F},
    {5, QColorSpace::TransferFunction::Gamma, 2.8F},
#if QT_VERSION >= QT_VERSION_CHECK(6, 8, 0)
    {16, QColorSpace::TransferFunction::St2084, 0},
    {18, QColorSpace::TransferFunction::Hlg, 0},
    {1, QColorSpace::TransferFunction::Bt2020, 0},
    {6, QColorSpace::TransferFunction::Bt2020, 0},
    {14, QColorSpace::TransferFunction::Bt2020, 0},
    {15, QColorSpace::TransferFunction::Bt2020, 0},
#endif
};

// Not valid for primaries that are not known.
QColorSpace made(quint8 primaries, const Transfer &transfer)
{
    const auto [code, function, gamma] = transfer;
    Q_UNUSED(code);
    switch (primaries) {
    case 1:
        return QColorSpace(QColorSpace::Primaries::SRgb, function, gamma);
    case 12:
        return QColorSpace(QColorSpace::Primaries::DciP3D65, function, gamma);
    case 9:
        // Those of BT.2020. Qt has a name for them since 6.8, and recognizes them by it alone.
#if QT_VERSION >= QT_VERSION_CHECK(6, 8, 0)
        return QColorSpace(QColorSpace::Primaries::Bt2020, function, gamma);
#else
        return QColorSpace({0.3127, 0.3290}, {0.708, 0.292}, {0.170, 0.797}, {0.131, 0.046}, function, gamma);
#endif
    default:
        return {};
    }
}

} // namespace

QColorSpace colorSpaceOf(const gip_metadata &metadata, quint32 color)
{
    QColorSpace space;
    if (metadata.present & GIP_METADATA_CICP) {
        for (const Transfer &transfer : transfers) {
            if (transfer.code == metadata.cicp.transfer)
                space = made(metadata.cicp.primaries, transfer);
        }
    }
    if (!space.isValid() && metadata.icc.size > 0) {
        const QByteArray profile(reinterpret_cast<const char *>(metadata.icc.data), int(metadata.icc.size));
        // The profile's header names the space of its samples. One of gray has no meaning for colours.
        if (color < GIP_COLOR_RGB || profile.mid(16, 4) != "GRAY")
            space = QColorSpace::fromIccProfile(profile);
    }
    return space.isValid() ? space : QColorSpace(QColorSpace::SRgb);
}

std::optional<gip_cicp> codesOf(const QColorSpace &space)
{
    for (const quint8 primaries : primariesCodes) {
        for (const Transfer &transfer : transfers) {
            if (made(primaries, transfer) == space)
                return gip_cicp{primaries, transfer.code};
        }
    }
    return std::nullopt;
}

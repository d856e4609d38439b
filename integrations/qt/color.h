// SPDX-License-Identifier: MIT OR Apache-2.0
#pragma once

#include <QColorSpace>
#include <gip.h>
#include <optional>

// The colour space of a picture with these metadata and this gip_color: that of its codes or else of its
// profile, as far as this Qt knows them, and otherwise sRGB.
QColorSpace colorSpaceOf(const gip_metadata &metadata, quint32 color);

// The codes for a colour space, if it has some that colorSpaceOf knows.
std::optional<gip_cicp> codesOf(const QColorSpace &space);

// SPDX-License-Identifier: MIT OR Apache-2.0
#include "handler.h"

#include <QImageIOPlugin>

// What Qt asks for a handler of a file.
class GipPlugin final : public QImageIOPlugin
{
    Q_OBJECT
    Q_PLUGIN_METADATA(IID QImageIOHandlerFactoryInterface_iid FILE "gip.json")

public:
    Capabilities capabilities(QIODevice *device, const QByteArray &format) const override
    {
        if (format == "gip")
            return CanRead | CanWrite;
        // A format that is asked for, and a device that is none of a file, are no matter of this plug-in.
        if (!format.isEmpty() || !device || !device->isOpen())
            return {};
        Capabilities able;
        if (device->isReadable() && GipHandler::canRead(device))
            able |= CanRead;
        return able;
    }

    QImageIOHandler *create(QIODevice *device, const QByteArray &format) const override
    {
        auto *handler = new GipHandler;
        handler->setDevice(device);
        handler->setFormat(format);
        return handler;
    }
};

#include "plugin.moc"

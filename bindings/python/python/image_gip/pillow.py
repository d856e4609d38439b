"""Makes Pillow open and save ``.gip``: importing this module is all that it takes.

``Image.open`` reads the header; the picture is rendered when it is needed. ``thumbnail`` and
``draft`` render it at the size that is wanted, from the first layers of the file, which costs a
fraction.

Modes are L, LA, RGB and RGBA with 8 bits per sample, and I;16 for gray pictures of 16 bits. Pillow
has no other mode of 16 bits: such files are rendered with 8, and ``image_gip.decode`` gives all 16
as a NumPy array. Pillow converts I;16 to 8 bits by clipping; after ``draft("L", image.size)`` the
picture is rendered with 8 bits.

Saving keeps the samples of these modes and those of I;16B, I (from 0 to 65535), 1, P, PA and RGBX.
La and RGBa, YCbCr, HSV and LAB become straight alpha and RGB, and so does CMYK by its ICC profile.

As with Pillow's other formats, pictures come as they are stored, and ``ImageOps.exif_transpose``
turns them. Metadata that stands after the first layer of a file, which is never an orientation, is
in ``info`` once the whole picture is loaded. ``save`` stores by itself what tells the colours: the
ICC profile of the picture, and ``cicp``, ``mastering_display`` and ``content_light`` of ``info``,
which are those of ``image_gip.encode``. It takes these as options (the profile as ``icc_profile``),
``exif`` and ``xmp``. Its other options are those of ``image_gip.encode``: with ``metadata="none"``,
turn the picture before, as nothing in the file tells how it is to be turned.
"""

from __future__ import annotations

import inspect
import math
from typing import IO, Any, cast

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageFile

from image_gip import _modes
from image_gip._errors import GipError, SignatureError
from image_gip._native import StreamDecoder, encode, info, read_header
from image_gip._types import Info, Limits

_FORMAT = "GIP"
#: What files of every version of the format begin with.
_START = b"\xc7GIP\r\n"
#: Pillow has limits of its own for the size of a picture.
_LIMITS = Limits(max_width=2**32 - 1, max_height=2**32 - 1, max_pixels=2**64 - 1)
#: Bytes of a file that are read at once for a draft.
_PIECE = 1024
#: The size of a draft with all Gaussians.
_LARGEST = (2**32 - 1, 2**32 - 1)
#: What `save` passes on to the encoder; Pillow has names of its own for the rest.
_OPTIONS = inspect.signature(encode).parameters.keys() - {"array", "icc", "exif", "xmp"}


class GipImageFile(ImageFile.ImageFile):
    """A ``.gip`` file that Pillow has opened."""

    format = _FORMAT
    format_description = "Picture of 2D Gaussians"

    def _open(self) -> None:
        assert self.fp is not None
        try:
            header = read_header(self.fp, limits=_LIMITS)
        except SignatureError as error:
            raise SyntaxError(str(error)) from error
        except GipError as error:
            raise OSError(str(error)) from error
        self._stored_size = header.size
        self._mode = "I;16" if (header.mode, header.depth) == ("L", 16) else header.mode
        self._noted: dict[str, Any] = {}
        self._note(header)
        self._texture = True
        self._set_size(header.size, is_draft=False)

    def _note(self, read: Info) -> None:
        """Takes the metadata of what was read of the file, as far as it is new."""
        found = {
            "cicp": read.cicp,
            "mastering_display": read.mastering_display,
            "content_light": read.content_light,
            "icc_profile": read.icc,
            "exif": None if read.exif is None else b"Exif\0\0" + read.exif,
            "xmp": read.xmp,
            "texts": read.texts or None,
        }
        for name, value in found.items():
            if value is not None and value != self._noted.get(name):
                self.info[name] = self._noted[name] = value

    def _set_size(self, size: tuple[int, int], *, is_draft: bool) -> None:
        self._size = size
        self._is_draft = is_draft
        self._set_tile()

    def _set_tile(self) -> None:
        arguments = (self._is_draft, self._texture, self._note)
        self.tile = [ImageFile._Tile("gip", (0, 0, *self._size), 0, arguments)]

    @property
    def texture(self) -> bool:
        """Whether texture is rendered: the noise in place of sand, water or leaves.

        It can be set until the picture is loaded.
        """
        return self._texture

    @texture.setter
    def texture(self, texture: bool) -> None:
        if not self.tile:
            raise ValueError("the picture is loaded already")
        self._texture = bool(texture)
        self._set_tile()

    def draft(
        self, mode: str | None, size: tuple[int, int] | None
    ) -> tuple[str, tuple[int, int, float, float]] | None:
        """Lets the picture be rendered at about ``size``, not smaller, in the aspect that it has.

        The fewer pixels are wanted, the fewer layers of the file are read. Has no effect once the
        picture is loaded. With ``mode`` "L", a picture of mode I;16 is rendered with 8 bits; other
        modes are ignored.
        """
        if size is None or not self.tile:
            return None
        if (self.mode, mode) == ("I;16", "L"):
            self._mode = "L"
        width, height = self._stored_size
        scale = min(max(size[0] / width, size[1] / height), 1.0)
        drafted = (max(math.ceil(width * scale), 1), max(math.ceil(height * scale), 1))
        self._set_size(drafted, is_draft=scale < 1.0)
        return self.mode, (0, 0, *drafted)

    def thumbnail(
        self,
        size: tuple[float, float],
        resample: Image.Resampling = Image.Resampling.BICUBIC,
        reducing_gap: float | None = 1.0,
    ) -> None:
        """Makes a thumbnail of the picture, in place, as ``Image.thumbnail`` does.

        With the ``reducing_gap`` of 1.0, it is rendered at the size that it shall have, and hardly
        resampled. With 2.0 or 3.0, it is rendered that much larger from more layers of the file,
        which takes longer and shows more detail; with ``None``, the whole picture is resampled.
        """
        super().thumbnail(size, resample, reducing_gap)
        # The file may be closed soon.
        self.load()

    def resize(
        self,
        size: tuple[int, int] | list[int] | NDArray[Any],
        resample: int | None = None,
        box: tuple[float, float, float, float] | None = None,
        reducing_gap: float | None = None,
    ) -> Image.Image:
        """Resizes the picture as ``Image.resize`` does."""
        if self.mode == "I;16":
            # It is faster, and Pillow has it for 8 bits only.
            reducing_gap = None
        return super().resize(size, resample, box, reducing_gap)

    def verify(self) -> None:
        """Checks the whole file.

        Raises:
            OSError: The file is damaged.
        """
        if self.fp is not None:
            self.fp.seek(0)
            try:
                info(self.fp, limits=_LIMITS)
            except GipError as error:
                raise OSError(str(error)) from error
        super().verify()


class _Decoder(ImageFile.PyDecoder):
    """Renders a picture at the size of its tile."""

    _pulls_fd = True

    def decode(self, buffer: Any) -> tuple[int, int]:
        assert self.fd is not None
        assert self.im is not None
        is_draft, texture, note = self.args
        stream = StreamDecoder(limits=_LIMITS)
        try:
            self._read(self.fd, stream, self.im.size if is_draft else None)
            if self.mode == "I;16":
                samples = stream.image(size=self.im.size, dtype=np.uint16, texture=texture)
                # Pillow's has the less significant byte first.
                samples = samples.astype("<u2", copy=False)
            else:
                samples = stream.image(size=self.im.size, dtype=np.uint8, texture=texture)
        except GipError as error:
            raise OSError(str(error)) from error
        note(stream.info)
        # It takes any buffer, without copying it.
        self.set_as_raw(cast("bytes", samples))
        return -1, 0

    def _read(self, file: IO[bytes], stream: StreamDecoder, draft: tuple[int, int] | None) -> None:
        """Feeds the file, or as much of it as a draft of that size needs."""
        try:
            if draft is None:
                stream.feed(file.read())
            else:
                for piece in iter(lambda: file.read(_PIECE), b""):
                    arrived = stream.feed(piece).arrived
                    if arrived == 0:
                        continue
                    wanted = stream.gaussians_for(*draft)
                    # What may come after all Gaussians, such as texture, is wanted with them.
                    if arrived >= wanted and wanted < stream.gaussians_for(*_LARGEST):
                        return
            stream.finish()
        except GipError:
            if not ImageFile.LOAD_TRUNCATED_IMAGES or stream.info is None:
                raise


def _accept(prefix: bytes) -> bool:
    # A file object may give any buffer.
    return bytes(prefix).startswith(_START)


def _save(image: Image.Image, file: IO[bytes], filename: str | bytes) -> None:
    asked = image.encoderinfo
    options = _modes.stored_colors(image)
    options |= {name: asked[name] for name in _OPTIONS & asked.keys()}
    # As in Pillow's own formats, the profile goes with the picture, and the rest on request.
    profile = asked.get("icc_profile", image.info.get("icc_profile"))
    if profile is not None:
        profile = bytes(memoryview(profile))
    options["icc"] = _modes.stored_profile(image, profile)
    if exif := asked.get("exif"):
        options["exif"] = exif.tobytes() if isinstance(exif, Image.Exif) else exif
    if xmp := asked.get("xmp"):
        options["xmp"] = xmp.encode() if isinstance(xmp, str) else xmp
    samples = _modes.samples(image, profile)
    try:
        encoded = encode(samples, **options)
    except GipError as error:
        raise OSError(str(error)) from error
    file.write(encoded)


Image.register_decoder("gip", _Decoder)
Image.register_open(_FORMAT, GipImageFile, _accept)
Image.register_save(_FORMAT, _save)
Image.register_extension(_FORMAT, ".gip")
Image.register_mime(_FORMAT, "image/vnd.gip")
